//! SIGINT, SIGTERM and SIGHUP as a descriptor to wait for.

use signal_hook::SigId;
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use std::io::{self, Read};
use std::os::fd::{AsFd, BorrowedFd};
use std::os::unix::net::UnixStream;

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
        for signal in [SIGINT, SIGTERM, SIGHUP] {
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
