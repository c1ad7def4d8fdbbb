//! How other threads wake the management thread.

use std::io::{self, Read, Write};
use std::os::fd::{AsFd, BorrowedFd};
use std::os::unix::net::UnixStream;
use std::sync::Arc;

/// The management thread sleeps until this is readable.
pub(crate) struct Wakeups(UnixStream);

/// Wakes the management thread.
#[derive(Clone, Debug)]
pub(crate) struct Waker(Arc<UnixStream>);

/// Why the management thread was woken, apart from requests and decisions, which it looks for at
/// each wake-up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Wakeup {
    /// The worker is initialised.
    pub(crate) ready: bool,
    /// The component ends.
    pub(crate) end: bool,
}

/// A connected pair.
pub(crate) fn waker() -> io::Result<(Waker, Wakeups)> {
    let (waker, wakeups) = UnixStream::pair()?;
    wakeups.set_nonblocking(true)?;
    Ok((Waker(Arc::new(waker)), Wakeups(wakeups)))
}

impl Waker {
    pub(crate) fn ready(&self) {
        self.write(b'r');
    }

    pub(crate) fn end(&self) {
        self.write(b'e');
    }

    /// There is a request or a decision.
    pub(crate) fn wake(&self) {
        self.write(b'w');
    }

    fn write(&self, byte: u8) {
        // The management thread has ended otherwise.
        let _ = (&*self.0).write_all(&[byte]);
    }
}

impl Wakeups {
    /// Takes the wake-ups so far.
    pub(crate) fn take(&self) -> Wakeup {
        let mut bytes = [0_u8; 8];
        match (&self.0).read(&mut bytes) {
            Ok(count) => Wakeup {
                ready: bytes[..count].contains(&b'r'),
                end: bytes[..count].contains(&b'e') || count == 0,
            },
            Err(_) => Wakeup::default(),
        }
    }
}

impl AsFd for Wakeups {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.0.as_fd()
    }
}
