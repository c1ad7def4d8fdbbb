//! Detects the death of a process.

use rc_middleware::wait;
use rustix::process::{Pid, PidfdFlags, pidfd_open};
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::time::Duration;

/// Monitors the process of one server by a pidfd, which stays valid when the kernel reuses the
/// process id.
pub(crate) struct ProcessMonitor {
    /// Port id of the server.
    pub(crate) server: u128,
    process: Process,
}

enum Process {
    Watched(OwnedFd),
    /// Dead before it could be monitored.
    Gone,
    /// Cannot be monitored; only a clean-up detects its death.
    Unknown,
}

impl ProcessMonitor {
    /// Monitors the process `pid`.
    pub(crate) fn new(server: u128, pid: Option<i32>) -> Self {
        let process = match pid.and_then(Pid::from_raw) {
            None => Process::Unknown,
            Some(pid) => match pidfd_open(pid, PidfdFlags::empty()) {
                Ok(descriptor) => Process::Watched(descriptor),
                Err(rustix::io::Errno::SRCH) => Process::Gone,
                Err(_) => Process::Unknown,
            },
        };
        Self { server, process }
    }

    /// Readable when the process is dead; `None` if it cannot be monitored.
    pub(crate) fn descriptor(&self) -> Option<BorrowedFd<'_>> {
        match &self.process {
            Process::Watched(descriptor) => Some(descriptor.as_fd()),
            Process::Gone | Process::Unknown => None,
        }
    }

    /// Whether the process was dead before it could be monitored.
    pub(crate) fn is_gone(&self) -> bool {
        matches!(self.process, Process::Gone)
    }

    /// Stops monitoring: the process is alive in another pid namespace, where its id means
    /// something else.
    pub(crate) fn give_up(&mut self) {
        self.process = Process::Unknown;
    }

    /// Whether the process is known to be dead. Asks the kernel.
    pub(crate) fn is_dead(&self) -> bool {
        match &self.process {
            Process::Watched(descriptor) => wait(&[descriptor.as_fd()], Duration::ZERO) != 0,
            Process::Gone => true,
            Process::Unknown => false,
        }
    }
}
