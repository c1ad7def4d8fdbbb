//! The management sockets of components on other machines: each is there on this one, too, and what is said to it goes
//! over the connection to the agent and back.

use super::log_tail::whole;
use rc_management::lines::LIMIT;
use rustix::event::PollFlags;
use rustix::net::{AddressFamily, SocketAddrUnix, SocketFlags, SocketType, connect, socket_with};
use std::collections::BTreeMap;
use std::io::{self, Read, Write};
use std::os::fd::{AsFd, BorrowedFd};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};

/// How many callers there may be at once; a further one is refused.
const MOST: usize = 32;
/// How much is read at once: as JSON it fits into a line of the protocol, whatever it consists of.
const PIECE: usize = LIMIT / 8;
/// How much may wait for a side that does not read.
const WAITING: usize = 4 << 20;

/// One caller of a component, at either end.
#[derive(Debug)]
struct ProxyConnection {
    stream: UnixStream,
    /// What is still to be written.
    out: Vec<u8>,
    /// The beginning of a character.
    part: Vec<u8>,
}

impl ProxyConnection {
    /// One read: its text, and whether the other side is still there.
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

    /// Writes what can be written; `false` if the other side is lost.
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

/// What comes from a wire.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Received {
    pub(crate) text: String,
    /// The other side is still there.
    pub(crate) there: bool,
}

/// All wires of one end, by the numbers that both ends give them.
#[derive(Debug, Default)]
pub(crate) struct ProxyConnections(BTreeMap<u64, ProxyConnection>);

impl ProxyConnections {
    /// Calls a component of this machine. It has to answer at once.
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

    /// What is waited for.
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

    /// Something can be read or written; none where there is no such wire any more.
    pub(crate) fn turn(&mut self, number: u64) -> Option<Received> {
        let wire = self.0.get_mut(&number)?;
        let (text, there) = wire.read();
        let there = wire.write() && there;
        if !there {
            self.0.remove(&number);
        }
        Some(Received { text, there })
    }

    /// Writes what has come from the other end; `false` if that is to be told that nobody hears it.
    pub(crate) fn send(&mut self, number: u64, text: &str) -> bool {
        let Some(wire) = self.0.get_mut(&number) else {
            // It was told already.
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

/// The sockets that stand for those of another machine, and who has called them.
#[derive(Debug, Default)]
pub(crate) struct SocketProxy {
    listeners: BTreeMap<u64, Listener>,
    pub(crate) connections: ProxyConnections,
    next: u64,
}

#[derive(Debug)]
struct Listener {
    component: String,
    socket: UnixListener,
    path: PathBuf,
}

impl Drop for Listener {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.path);
    }
}

impl SocketProxy {
    /// Lets a component be called here.
    pub(crate) fn listen(&mut self, component: &str, path: &Path) -> io::Result<()> {
        self.close(component);
        let socket = UnixListener::bind(path)?;
        socket.set_nonblocking(true)?;
        let listener = Listener {
            component: component.to_owned(),
            socket,
            path: path.to_owned(),
        };
        self.listeners.insert(self.next, listener);
        self.next += 1;
        Ok(())
    }

    /// A component has ended.
    pub(crate) fn close(&mut self, component: &str) {
        self.listeners.retain(|_, l| l.component != component);
    }

    /// The connection has ended.
    pub(crate) fn clear(&mut self) {
        self.listeners.clear();
        self.connections.clear();
    }

    /// What is waited for.
    pub(crate) fn descriptors(&self) -> impl Iterator<Item = (u64, BorrowedFd<'_>, PollFlags)> {
        let listeners = self.listeners.iter();
        let listeners = listeners.map(|(at, l)| (*at, l.socket.as_fd(), PollFlags::IN));
        listeners.chain(self.connections.descriptors())
    }

    /// Lets a caller in where `number` is that of a socket: gives the number of the wire, and who is called.
    pub(crate) fn accept(&mut self, number: u64) -> Option<(u64, String)> {
        let listener = self.listeners.get(&number)?;
        let (stream, _) = listener.socket.accept().ok()?;
        stream.set_nonblocking(true).ok()?;
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
