//! Whether a process is alive.

use rc_middleware::wait;
use rustix::process::{Pid, PidfdFlags, pidfd_open};
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::time::Duration;

/// Watches the process of one server. A process id is looked up once; afterwards its descriptor stands for the
/// process, even when the id is given to another one.
pub(crate) struct ProcessMonitor {
    /// Which server, in iceoryx2's terms.
    pub(crate) server: u128,
    process: Process,
}

enum Process {
    Watched(OwnedFd),
    /// Gone before it could be watched.
    Gone,
    /// It cannot be watched; its death shows only when somebody cleans up.
    Unknown,
}

impl ProcessMonitor {
    /// Watches the process `pid`.
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

    /// Readable when the process is dead, where that can be watched.
    pub(crate) fn descriptor(&self) -> Option<BorrowedFd<'_>> {
        match &self.process {
            Process::Watched(descriptor) => Some(descriptor.as_fd()),
            Process::Gone | Process::Unknown => None,
        }
    }

    /// Whether its process was gone before it could be watched.
    pub(crate) fn is_gone(&self) -> bool {
        matches!(self.process, Process::Gone)
    }

    /// Watches no longer: it is alive, and its process id means something else here.
    pub(crate) fn give_up(&mut self) {
        self.process = Process::Unknown;
    }

    /// Whether the process is known to be dead.
    pub(crate) fn is_dead(&self) -> bool {
        match &self.process {
            Process::Watched(descriptor) => wait(&[descriptor.as_fd()], Duration::ZERO) != 0,
            Process::Gone => true,
            Process::Unknown => false,
        }
    }
}
