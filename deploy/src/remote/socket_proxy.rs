//! Makes the management sockets of remote components available on this machine, over the connection
//! to their agent.

use super::log_tail::whole;
use crate::process::listener::Listener;
use rc_management::lines::LIMIT;
use rustix::event::PollFlags;
use rustix::net::{AddressFamily, SocketAddrUnix, SocketFlags, SocketType, connect, socket_with};
use std::collections::BTreeMap;
use std::io::{self, Read, Write};
use std::os::fd::{AsFd, BorrowedFd};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// How many callers may be connected. Further callers are refused.
const MOST: usize = 32;
/// The size of a read in bytes. As JSON, it fits into a line of the protocol.
const PIECE: usize = LIMIT / 8;
/// How many bytes may wait for a side that does not read.
const WAITING: usize = 4 << 20;

/// One caller of a component, at either end.
#[derive(Debug)]
struct ProxyConnection {
    stream: UnixStream,
    /// Output that waits.
    out: Vec<u8>,
    /// The beginning of an incomplete character.
    part: Vec<u8>,
}

impl ProxyConnection {
    /// Reads once. Returns the text, and whether the other side is still connected.
    fn read(&mut self) -> (String, bool) {
        let mut buffer = [0; PIECE];
        let there = match self.stream.read(&mut buffer) {
            Ok(0) => false,
            Ok(count) => {
                self.part.extend_from_slice(&buffer[..count]);
                true
            }
            Err(error) => matches!(
                error.kind(),
                io::ErrorKind::WouldBlock | io::ErrorKind::Interrupted
            ),
        };
        let whole = self.part.drain(..whole(&self.part));
        let whole: Vec<u8> = whole.collect();
        (String::from_utf8_lossy(&whole).into_owned(), there)
    }

    /// Writes as much as the other side takes. Returns `false` if the connection is lost.
    fn write(&mut self) -> bool {
        while !self.out.is_empty() {
            match self.stream.write(&self.out) {
                Ok(count) => drop(self.out.drain(..count)),
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => break,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(_) => return false,
            }
        }
        self.out.len() <= WAITING
    }
}

/// What was read from a connection.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Received {
    pub(crate) text: String,
    /// Whether the other side is still connected.
    pub(crate) there: bool,
}

/// The connections of one side, by numbers that both sides use.
#[derive(Debug, Default)]
pub(crate) struct ProxyConnections(BTreeMap<u64, ProxyConnection>);

impl ProxyConnections {
    /// Connects to a component of this machine. It must accept at once.
    pub(crate) fn call(&mut self, number: u64, path: &Path) -> io::Result<()> {
        let flags = SocketFlags::NONBLOCK | SocketFlags::CLOEXEC;
        let socket = socket_with(AddressFamily::UNIX, SocketType::STREAM, flags, None)?;
        connect(&socket, &SocketAddrUnix::new(path)?)?;
        self.add(number, UnixStream::from(socket));
        Ok(())
    }

    fn add(&mut self, number: u64, stream: UnixStream) {
        let wire = ProxyConnection {
            stream,
            out: Vec::new(),
            part: Vec::new(),
        };
        self.0.insert(number, wire);
    }

    /// The descriptors to wait for.
    pub(crate) fn descriptors(&self) -> impl Iterator<Item = (u64, BorrowedFd<'_>, PollFlags)> {
        self.0.iter().map(|(number, wire)| {
            let flags = if wire.out.is_empty() {
                PollFlags::IN
            } else {
                PollFlags::IN | PollFlags::OUT
            };
            (*number, wire.stream.as_fd(), flags)
        })
    }

    /// Reads and writes. `None` if the connection does not exist any more.
    pub(crate) fn turn(&mut self, number: u64) -> Option<Received> {
        let wire = self.0.get_mut(&number)?;
        let (text, there) = wire.read();
        let there = wire.write() && there;
        if !there {
            self.0.remove(&number);
        }
        Some(Received { text, there })
    }

    /// Writes what came from the other side. Returns `false` if the connection is lost, which the
    /// other side does not know yet.
    pub(crate) fn send(&mut self, number: u64, text: &str) -> bool {
        let Some(wire) = self.0.get_mut(&number) else {
            // The other side knows it already.
            return true;
        };
        wire.out.extend_from_slice(text.as_bytes());
        if wire.write() {
            return true;
        }
        self.0.remove(&number);
        false
    }

    pub(crate) fn shut(&mut self, number: u64) {
        if let Some(mut wire) = self.0.remove(&number) {
            let _ = wire.write();
        }
    }

    pub(crate) fn clear(&mut self) {
        self.0.clear();
    }
}

/// Sockets of remote components, and their callers.
#[derive(Debug, Default)]
pub(crate) struct SocketProxy {
    listeners: BTreeMap<u64, ComponentSocket>,
    pub(crate) connections: ProxyConnections,
    next: u64,
}

#[derive(Debug)]
struct ComponentSocket {
    component: String,
    socket: Listener,
    path: PathBuf,
}

impl Drop for ComponentSocket {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.path);
    }
}

impl SocketProxy {
    /// Listens for callers of a component.
    pub(crate) fn listen(&mut self, component: &str, path: &Path) -> io::Result<()> {
        self.close(component);
        let listener = ComponentSocket {
            component: component.to_owned(),
            socket: Listener::bind(path)?,
            path: path.to_owned(),
        };
        self.listeners.insert(self.next, listener);
        self.next += 1;
        Ok(())
    }

    /// Stops listening for callers of a component.
    pub(crate) fn close(&mut self, component: &str) {
        self.listeners.retain(|_, l| l.component != component);
    }

    /// Closes everything: the connection to the agent has ended.
    pub(crate) fn clear(&mut self) {
        self.listeners.clear();
        self.connections.clear();
    }

    /// The descriptors to wait for.
    pub(crate) fn descriptors(&self) -> impl Iterator<Item = (u64, BorrowedFd<'_>, PollFlags)> {
        let listeners = self.listeners.iter();
        let listeners = listeners
            .filter_map(|(number, l)| Some((*number, l.socket.descriptor()?, PollFlags::IN)));
        listeners.chain(self.connections.descriptors())
    }

    /// When a pause of a socket is over.
    pub(crate) fn deadline(&self) -> Option<Instant> {
        self.listeners
            .values()
            .filter_map(|l| l.socket.deadline())
            .min()
    }

    /// Accepts callers again where a pause is over.
    pub(crate) fn resume(&mut self, now: Instant) {
        for listener in self.listeners.values_mut() {
            listener.socket.resume(now);
        }
    }

    /// Accepts a caller if `number` is that of a socket. Returns the number of the connection, and
    /// the component.
    pub(crate) fn accept(&mut self, number: u64) -> Option<(u64, String)> {
        let listener = self.listeners.get_mut(&number)?;
        let stream = listener.socket.accept()?;
        if self.connections.0.len() >= MOST {
            return None;
        }
        let wire = self.next;
        self.next += 1;
        let component = listener.component.clone();
        self.connections.add(wire, stream);
        Some((wire, component))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::net::UnixListener;

    #[test]
    fn a_caller_is_heard_at_the_other_end() {
        let folder = tempfile::tempdir().expect("a folder");
        let (here, there) = (folder.path().join("here"), folder.path().join("there"));
        let component = UnixListener::bind(&there).expect("a socket");
        let mut sockets = SocketProxy::default();
        let mut connections = ProxyConnections::default();
        sockets.listen("a", &here).expect("a socket");
        let (socket, ..) = sockets.descriptors().next().expect("a socket");
        let mut caller = UnixStream::connect(&here).expect("a caller");
        let (wire, called) = sockets.accept(socket).expect("a caller");
        assert_eq!(called, "a");
        connections.call(wire, &there).expect("to call");
        let (mut answering, _) = component.accept().expect("a call");
        caller
            .write_all("h\u{f6}".as_bytes().split_last().expect("bytes").1)
            .expect("written");
        let heard = sockets.connections.turn(wire).expect("a wire");
        assert_eq!((heard.text.as_str(), heard.there), ("h", true));
        assert!(connections.send(wire, &heard.text));
        let mut byte = [0];
        answering.read_exact(&mut byte).expect("a byte");
        assert_eq!(&byte, b"h");
        drop(answering);
        assert!(!connections.turn(wire).expect("a wire").there);
        sockets.connections.shut(wire);
        assert_eq!(caller.read(&mut byte).expect("its end"), 0);
        sockets.close("a");
        assert!(!here.exists());
        assert!(connections.call(7, &here).is_err());
    }
}
