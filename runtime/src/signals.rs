//! The signals that end a process in order.

use std::io::{self, Read};
use std::os::fd::{AsFd, BorrowedFd};
use std::os::unix::net::UnixStream;
use std::time::{Duration, Instant};

/// Signals within this time count as one.
const BURST: Duration = Duration::from_millis(300);

/// SIGINT, SIGTERM and SIGHUP of this process. Readable when one has come.
pub(crate) struct Signals {
    pipe: UnixStream,
    /// When the first signal came.
    first: Option<Instant>,
}

impl Signals {
    /// Takes the signals from now on.
    pub(crate) fn register() -> io::Result<Self> {
        let (pipe, write) = UnixStream::pair()?;
        pipe.set_nonblocking(true)?;
        for signal in [
            signal_hook::consts::SIGINT,
            signal_hook::consts::SIGTERM,
            signal_hook::consts::SIGHUP,
        ] {
            signal_hook::low_level::pipe::register(signal, write.try_clone()?)?;
        }
        Ok(Self { pipe, first: None })
    }

    /// Takes the pending signals. Returns whether a signal came after the first one: the process
    /// ends at once then. Signals that come together count as one: a terminal that closes, or a
    /// tool that signals a process and then its group, sends several.
    pub(crate) fn take(&mut self) -> bool {
        let mut bytes = [0_u8; 16];
        let _ = self.pipe.read(&mut bytes);
        let first = *self.first.get_or_insert_with(Instant::now);
        first.elapsed() > BURST
    }
}

impl AsFd for Signals {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.pipe.as_fd()
    }
}
