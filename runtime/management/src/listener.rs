//! A Unix socket that pauses when the system refuses to accept.
//!
//! A caller that cannot be accepted stays in the queue of the socket, which stays readable. Without
//! a pause, a process without free descriptors would try to accept in a busy loop.

use rustix::net::sockopt::socket_peercred;
use rustix::process::{Uid, getuid};
use std::io::{self, ErrorKind};
use std::os::fd::{AsFd, BorrowedFd};
use std::os::unix::fs::MetadataExt;
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// How long no connection is accepted after the system refused one.
const PAUSE: Duration = Duration::from_millis(200);

/// A listening Unix socket that does not block.
#[derive(Debug)]
pub struct Listener {
    socket: UnixListener,
    /// The path and the file there; none for an abstract socket, which has no permissions.
    file: Option<(PathBuf, (u64, u64))>,
    paused_until: Option<Instant>,
}

impl Listener {
    /// Listens at `path`, which must not exist.
    pub fn bind(path: &Path) -> io::Result<Self> {
        let mut listener = Self::of(UnixListener::bind(path)?)?;
        listener.file = Some((path.to_owned(), file(path)?));
        Ok(listener)
    }

    /// Takes an abstract socket. Callers of other users are turned away.
    pub fn of(socket: UnixListener) -> io::Result<Self> {
        socket.set_nonblocking(true)?;
        Ok(Self {
            socket,
            file: None,
            paused_until: None,
        })
    }

    /// Listens at its path again if its file is not there any more. Returns whether it was not. The
    /// caller owns the path.
    pub fn restore(&mut self) -> io::Result<bool> {
        let Some((path, own)) = &self.file else {
            return Ok(false);
        };
        if file(path).is_ok_and(|found| found == *own) {
            return Ok(false);
        }
        match std::fs::remove_file(path) {
            Err(error) if error.kind() != ErrorKind::NotFound => return Err(error),
            _ => {}
        }
        *self = Self::bind(path)?;
        Ok(true)
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
            Ok((stream, _)) => {
                let may = self.file.is_some() || is_of_this_user(&stream);
                (may && stream.set_nonblocking(true).is_ok()).then_some(stream)
            }
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

/// Device and number of a file.
fn file(path: &Path) -> io::Result<(u64, u64)> {
    let found = std::fs::symlink_metadata(path)?;
    Ok((found.dev(), found.ino()))
}

/// Whether the process at the other end is of this user, or of root.
pub(crate) fn is_of_this_user(stream: &impl AsFd) -> bool {
    socket_peercred(stream).is_ok_and(|peer| peer.uid == getuid() || peer.uid == Uid::ROOT)
}
