//! A Unix socket that pauses when the system refuses to accept.
//!
//! A caller that cannot be accepted stays in the queue of the socket, which stays readable. Without
//! a pause, a process that has no free descriptor would accept in vain, again and again, at full
//! speed.

use std::io::{self, ErrorKind};
use std::os::fd::{AsFd, BorrowedFd};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::Path;
use std::time::{Duration, Instant};

/// How long no connection is accepted after the system refused one.
const PAUSE: Duration = Duration::from_millis(200);

/// A listening Unix socket that does not block.
#[derive(Debug)]
pub struct Listener {
    socket: UnixListener,
    paused_until: Option<Instant>,
}

impl Listener {
    /// Listens at `path`, which must not exist.
    pub fn bind(path: &Path) -> io::Result<Self> {
        let socket = UnixListener::bind(path)?;
        socket.set_nonblocking(true)?;
        Ok(Self {
            socket,
            paused_until: None,
        })
    }

    /// Becomes readable when a client connects. There is none during a pause.
    pub fn descriptor(&self) -> Option<BorrowedFd<'_>> {
        self.paused_until.is_none().then(|| self.socket.as_fd())
    }

    /// The end of the pause.
    pub fn deadline(&self) -> Option<Instant> {
        self.paused_until
    }

    /// Ends a pause that is over.
    pub fn resume(&mut self, now: Instant) {
        self.paused_until.take_if(|until| now >= *until);
    }

    /// Accepts one caller. The stream does not block.
    pub fn accept(&mut self) -> Option<UnixStream> {
        match self.socket.accept() {
            Ok((stream, _)) => stream.set_nonblocking(true).is_ok().then_some(stream),
            Err(error) => {
                let is_gone = matches!(
                    error.kind(),
                    ErrorKind::WouldBlock | ErrorKind::Interrupted | ErrorKind::ConnectionAborted
                );
                if !is_gone {
                    self.paused_until = Some(Instant::now() + PAUSE);
                }
                None
            }
        }
    }
}
