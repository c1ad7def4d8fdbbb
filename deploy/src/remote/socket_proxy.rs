//! Makes the management sockets of remote components available on this machine, over the connection
//! to their agent.

use super::log_tail::whole;
use rc_management::lines::LIMIT;
use rc_management::server::MAX_CLIENTS;
use rc_management::{Listener, Output};
use rustix::event::PollFlags;
use rustix::net::{AddressFamily, SocketAddrUnix, SocketFlags, SocketType, connect, socket_with};
use std::collections::BTreeMap;
use std::io::{self, Read};
use std::os::fd::{AsFd, BorrowedFd};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// The size of a read in bytes. As JSON, it fits into a line of the protocol.
const PIECE: usize = LIMIT / 8;
/// How many bytes may wait for a side that does not read.
const WAITING: usize = 4 << 20;
/// How many bytes may wait for the other machine before callers are read on. It bounds how
/// long data of callers delay its heartbeats and commands.
pub(crate) const ROOM: usize = 64 << 10;

/// One caller of a component, at either end.
#[derive(Debug)]
struct ProxyConnection {
    stream: UnixStream,
    out: Output,
    /// The beginning of an incomplete character.
    part: Vec<u8>,
    /// When it was made, or when it last sent something.
    active: Instant,
}

impl ProxyConnection {
    /// Reads once. Returns the text, and whether the other side is still connected.
    fn read(&mut self) -> (String, bool) {
        let mut buffer = [0; PIECE];
        let there = match self.stream.read(&mut buffer) {
            Ok(0) => false,
            Ok(count) => {
                self.active = Instant::now();
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
        self.out.write(&self.stream).is_ok()
    }
}

/// Result of reading from a connection.
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
            out: Output::up_to(WAITING),
            part: Vec::new(),
            active: Instant::now(),
        };
        self.0.insert(number, wire);
    }

    /// The descriptors to wait for; connections are read only if there is `room` for their
    /// messages.
    pub(crate) fn descriptors(
        &self,
        room: bool,
    ) -> impl Iterator<Item = (u64, BorrowedFd<'_>, PollFlags)> {
        self.0.iter().filter_map(move |(number, wire)| {
            let mut flags = PollFlags::empty();
            flags.set(PollFlags::IN, room);
            flags.set(PollFlags::OUT, !wire.out.is_empty());
            // Without flags, `poll` would report an end without a reader.
            (!flags.is_empty()).then(|| (*number, wire.stream.as_fd(), flags))
        })
    }

    /// Writes, and reads if there is room. `None` if the connection does not exist any more.
    pub(crate) fn turn(&mut self, number: u64, room: bool) -> Option<Received> {
        let wire = self.0.get_mut(&number)?;
        let (text, there) = if room {
            wire.read()
        } else {
            (String::new(), true)
        };
        let there = wire.write() && there;
        if !there {
            self.0.remove(&number);
        }
        Some(Received { text, there })
    }

    /// Writes the data of the other side. Returns `false` if the connection is lost, which the
    /// other side does not know yet.
    pub(crate) fn send(&mut self, number: u64, text: &str) -> bool {
        let Some(wire) = self.0.get_mut(&number) else {
            // The other side knows it already.
            return true;
        };
        wire.out.push(text.as_bytes());
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

    /// The descriptors to wait for; callers are read only if there is `room` for their messages.
    pub(crate) fn descriptors(
        &self,
        room: bool,
    ) -> impl Iterator<Item = (u64, BorrowedFd<'_>, PollFlags)> {
        let listeners = self.listeners.iter();
        let listeners = listeners
            .filter_map(|(number, l)| Some((*number, l.socket.descriptor()?, PollFlags::IN)));
        listeners.chain(self.connections.descriptors(room))
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

    /// Accepts a caller if `number` is that of a socket. If there are too many, the one that has
    /// been idle the longest gives way.
    pub(crate) fn accept(&mut self, number: u64) -> Option<Accepted> {
        let listener = self.listeners.get_mut(&number)?;
        let stream = listener.socket.accept()?;
        let component = listener.component.clone();
        let callers = &mut self.connections.0;
        let dropped = if callers.len() < MAX_CLIENTS {
            None
        } else {
            let oldest = callers.iter().min_by_key(|(_, wire)| wire.active);
            oldest.map(|(wire, _)| *wire)
        };
        dropped.map(|wire| callers.remove(&wire));
        let wire = self.next;
        self.next += 1;
        self.connections.add(wire, stream);
        Some(Accepted {
            wire,
            component,
            dropped,
        })
    }
}

/// A new caller.
#[derive(Debug)]
pub(crate) struct Accepted {
    /// The number of its connection.
    pub(crate) wire: u64,
    pub(crate) component: String,
    /// The connection that gave way to it.
    pub(crate) dropped: Option<u64>,
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;
    use std::os::unix::net::UnixListener;

    #[test]
    fn requests_reach_the_other_end() {
        let folder = tempfile::tempdir().expect("a folder");
        let (here, there) = (folder.path().join("here"), folder.path().join("there"));
        let component = UnixListener::bind(&there).expect("a socket");
        let mut sockets = SocketProxy::default();
        let mut connections = ProxyConnections::default();
        sockets.listen("a", &here).expect("a socket");
        let (socket, ..) = sockets.descriptors(true).next().expect("a socket");
        let mut caller = UnixStream::connect(&here).expect("a caller");
        let accepted = sockets.accept(socket).expect("a caller");
        assert_eq!((&*accepted.component, accepted.dropped), ("a", None));
        let wire = accepted.wire;
        connections.call(wire, &there).expect("to call");
        let (mut answering, _) = component.accept().expect("a call");
        caller
            .write_all("h\u{f6}".as_bytes().split_last().expect("bytes").1)
            .expect("written");
        let silent = sockets.connections.turn(wire, false).expect("a wire");
        assert_eq!((silent.text.as_str(), silent.there), ("", true), "no room");
        let heard = sockets.connections.turn(wire, true).expect("a wire");
        assert_eq!((heard.text.as_str(), heard.there), ("h", true));
        assert!(connections.send(wire, &heard.text));
        let mut byte = [0];
        answering.read_exact(&mut byte).expect("a byte");
        assert_eq!(&byte, b"h");
        drop(answering);
        assert!(!connections.turn(wire, true).expect("a wire").there);
        sockets.connections.shut(wire);
        assert_eq!(caller.read(&mut byte).expect("its end"), 0);
        sockets.close("a");
        assert!(!here.exists());
        assert!(connections.call(7, &here).is_err());
    }
    #[test]
    fn the_longest_idle_connection_is_closed_first() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("here");
        let mut sockets = SocketProxy::default();
        sockets.listen("a", &path).expect("a socket");
        let (socket, ..) = sockets.descriptors(true).next().expect("a socket");
        let mut call = || {
            let caller = UnixStream::connect(&path).expect("a caller");
            (caller, sockets.accept(socket).expect("a caller"))
        };
        let mut callers: Vec<_> = (0..MAX_CLIENTS).map(|_| call()).collect();
        assert!(
            callers
                .iter()
                .all(|(_, accepted)| accepted.dropped.is_none())
        );
        callers[0].0.write_all(b"x").expect("written");
        let first = callers[0].1.wire;
        let second = callers[1].1.wire;
        let heard = sockets.connections.turn(first, true).expect("a wire");
        assert_eq!(heard.text, "x");
        let caller = UnixStream::connect(&path).expect("a caller");
        let accepted = sockets.accept(socket).expect("a caller");
        assert_eq!(accepted.dropped, Some(second));
        assert_eq!(callers[1].0.read(&mut [0]).expect("its end"), 0);
        assert_eq!(sockets.connections.0.len(), MAX_CLIENTS);
        drop(caller);
    }
}
