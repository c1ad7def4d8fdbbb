//! SIGINT, SIGTERM and SIGHUP as a descriptor to wait for.
//!
//! A hang-up that the process was started to ignore, as `nohup` does, stays ignored. SIGTSTP does
//! nothing: a supervisor that Ctrl-Z stopped would watch nothing, while its components run on.

use signal_hook::SigId;
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGTSTP};
use std::io::{self, Read};
use std::os::fd::{AsFd, BorrowedFd};
use std::os::unix::net::UnixStream;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Catches SIGINT, SIGTERM and SIGHUP while it exists.
#[derive(Debug)]
pub(crate) struct Signals {
    pipe: UnixStream,
    ids: Vec<SigId>,
}

impl Signals {
    /// Catches them.
    pub(crate) fn new() -> io::Result<Self> {
        let (pipe, write) = UnixStream::pair()?;
        pipe.set_nonblocking(true)?;
        let mut signals = Self {
            pipe,
            ids: Vec::new(),
        };
        let nothing = Arc::new(AtomicBool::new(false));
        signals
            .ids
            .push(signal_hook::flag::register(SIGTSTP, nothing)?);
        let hangs_up = !is_ignored(SIGHUP);
        let ends = [SIGINT, SIGTERM].into_iter();
        for signal in ends.chain(hangs_up.then_some(SIGHUP)) {
            let write = write.try_clone()?;
            signals
                .ids
                .push(signal_hook::low_level::pipe::register(signal, write)?);
        }
        Ok(signals)
    }

    pub(crate) fn descriptor(&self) -> BorrowedFd<'_> {
        self.pipe.as_fd()
    }

    /// Returns how many signals have come.
    pub(crate) fn take(&self) -> usize {
        let mut buffer = [0; 64];
        (&self.pipe).read(&mut buffer).unwrap_or(0)
    }
}

impl Drop for Signals {
    fn drop(&mut self) {
        for id in self.ids.drain(..) {
            signal_hook::low_level::unregister(id);
        }
    }
}

/// Whether this process ignores a signal: `SigIgn` of `proc_pid_status(5)`.
fn is_ignored(signal: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status
        .lines()
        .find_map(|line| line.strip_prefix("SigIgn:"))
        .and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    mask.is_some_and(|mask| mask >> (signal - 1) & 1 == 1)
}
