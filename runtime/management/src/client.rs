//! The client of components and supervisors.

use crate::lines::{self, Line, Lines, Overlong};
use crate::listener::is_of_this_user;
use crate::output::Output;
use crate::rpc::{self, Error};
use crate::supervisor;
use rc_diagnostics::foreign::{clean, clean_bytes};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;
use rustix::net::sockopt::{Timeout, set_socket_timeout, socket_peercred};
use rustix::net::{AddressFamily, SocketAddrUnix, SocketFlags, SocketType, connect, socket_with};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::VecDeque;
use std::io;
use std::net::Shutdown;
use std::os::fd::{AsFd, BorrowedFd};
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::time::{Duration, Instant};

/// The longest message, in bytes: the status of a network has many times the length of a
/// component's line.
pub const LONGEST: usize = 64 * lines::LIMIT;
/// The most bytes of messages that wait for [`Client::next`] and [`Client::receive`].
const MOST_WAITING: usize = 2 * LONGEST;

/// A connection to the management socket of a component or a supervisor.
///
/// [`Client::call`] waits for an answer. A program that waits for several things sends with
/// [`Client::send`], polls the descriptor and takes what arrives from [`Client::receive`], which
/// never waits.
///
/// ```no_run
/// use rc_management::{Client, component};
/// use std::path::Path;
/// use std::time::Duration;
///
/// let limit = Duration::from_secs(2);
/// let mut client = Client::connect(Path::new("/run/user/1000/robocomp/default/lidar.sock"), limit)?;
/// let status: component::Status = client.call(&component::Request::Status, limit)?;
/// println!("{} runs since {} s", status.name, status.uptime_s);
/// # Ok::<(), rc_management::CallError>(())
/// ```
#[derive(Debug)]
pub struct Client {
    stream: UnixStream,
    lines: Lines,
    output: Output,
    requests: u64,
    received: VecDeque<Received>,
    /// The sum of their sizes.
    waiting: usize,
    closed: bool,
}

/// A message that waits, and about how many bytes it takes.
#[derive(Debug)]
struct Received {
    incoming: Incoming,
    size: usize,
}

/// A received message.
#[derive(Clone, Debug, PartialEq)]
pub enum Incoming {
    /// The answer to the request with this number; none if the other side could not read the
    /// request.
    Answer(Option<u64>, Result<Value, Error>),
    /// A notification: its method and parameters.
    Notification(String, Value),
    /// An invalid line.
    Unknown(String),
}

/// Why a call has no result.
#[derive(Debug, thiserror::Error)]
pub enum CallError {
    /// The connection failed.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// No answer came within this time.
    #[error("no answer came within {0:?}")]
    TimedOut(Duration),
    /// The other side closed the connection before it answered.
    #[error("the connection closed before the answer came")]
    Closed,
    /// The other side refuses.
    #[error(transparent)]
    Refused(#[from] Error),
    /// This is not an answer to the request.
    #[error("the answer is `{0}`")]
    Unexpected(String),
}

impl Client {
    /// Connects to the socket at `path`, within `limit`. A limit of zero does not wait for a
    /// listener that is busy.
    ///
    /// `NotFound` and `ConnectionRefused` mean that there is no listener, `WouldBlock` that the
    /// listener did not accept in time.
    pub fn connect(path: &Path, limit: Duration) -> io::Result<Self> {
        Self::connect_to(&SocketAddrUnix::new(path)?, limit)
    }

    /// Connects to the supervisor of a network of this user by its abstract socket. This socket has
    /// no path, so it is found whatever run directory the environment chooses. Errors are those of
    /// [`Client::connect`].
    pub fn connect_supervisor(network: &str, limit: Duration) -> io::Result<Self> {
        let address = SocketAddrUnix::new_abstract_name(&supervisor::abstract_name(network))?;
        let client = Self::connect_to(&address, limit)?;
        // Any user may listen there.
        if is_of_this_user(&client.stream) {
            Ok(client)
        } else {
            Err(io::ErrorKind::NotFound.into())
        }
    }

    /// The process at the other end when the connection was made, as this process sees it: 0 if it
    /// is in a pid namespace that this process cannot see.
    pub fn peer(&self) -> Option<i32> {
        let peer = socket_peercred(&self.stream).ok()?;
        Some(peer.pid.as_raw_nonzero().get())
    }

    fn connect_to(address: &SocketAddrUnix, limit: Duration) -> io::Result<Self> {
        let flags = if limit.is_zero() {
            SocketFlags::NONBLOCK | SocketFlags::CLOEXEC
        } else {
            SocketFlags::CLOEXEC
        };
        let socket = socket_with(AddressFamily::UNIX, SocketType::STREAM, flags, None)?;
        if !limit.is_zero() {
            // A Unix socket waits for a place in the queue of the listener, at most for its limit
            // to send.
            set_socket_timeout(&socket, Timeout::Send, Some(limit))?;
        }
        while let Err(error) = connect(&socket, address) {
            if error != Errno::INTR {
                return Err(error.into());
            }
        }
        let stream = UnixStream::from(socket);
        stream.set_nonblocking(true)?;
        Ok(Self {
            stream,
            lines: Lines::up_to(LONGEST, Overlong::Skip),
            output: Output::up_to(LONGEST),
            requests: 0,
            received: VecDeque::new(),
            waiting: 0,
            closed: false,
        })
    }

    /// Whether requests wait until the other side reads; poll the descriptor for writing then, too.
    pub fn has_output(&self) -> bool {
        !self.output.is_empty()
    }

    /// Sends a request, as far as that is possible at once, and returns its number.
    pub fn send(&mut self, request: &impl Serialize) -> u64 {
        self.requests += 1;
        self.output.push(&rpc::request(self.requests, request));
        // `receive` reports a failure.
        let _ = self.output.write(&self.stream);
        self.requests
    }

    /// Writes and reads what is possible at once. Returns what has arrived, and whether the
    /// connection is still open.
    pub fn receive(&mut self) -> (Vec<Incoming>, bool) {
        self.turn();
        self.waiting = 0;
        let received = self.received.drain(..).map(|received| received.incoming);
        (received.collect(), !self.closed)
    }

    /// Sends a request and waits for its answer, at most for `limit`. Notifications that arrive
    /// meanwhile are kept for [`Client::next`] and [`Client::receive`]. Answers to earlier requests
    /// are dropped. Where more than 8 MiB are kept, the connection closes with an error.
    pub fn call<T: DeserializeOwned>(
        &mut self,
        request: &impl Serialize,
        limit: Duration,
    ) -> Result<T, CallError> {
        let number = self.send(request);
        let is_answer = |incoming: &Incoming| match incoming {
            // An answer without a number is to a request that the other side could not read.
            Incoming::Answer(answered, _) => answered.is_none_or(|answered| answered == number),
            Incoming::Notification(..) => false,
            Incoming::Unknown(_) => true,
        };
        let answer = self.until(limit, |client| {
            client.drop_answers_before(number);
            let mut received = client.received.iter();
            let at = received.position(|received| is_answer(&received.incoming))?;
            client.take(at)
        });
        match answer? {
            Incoming::Answer(_, result) => {
                let result = result?;
                T::deserialize(&result)
                    .map_err(|_| CallError::Unexpected(clean(&result.to_string())))
            }
            Incoming::Unknown(text) => Err(CallError::Unexpected(text)),
            Incoming::Notification(..) => Err(CallError::Closed),
        }
    }

    /// Waits for the next message, at most for `limit`.
    pub fn next(&mut self, limit: Duration) -> Result<Incoming, CallError> {
        self.until(limit, |client| client.take(0))
    }

    /// Takes the message at this place of those that wait.
    fn take(&mut self, at: usize) -> Option<Incoming> {
        let Received { incoming, size } = self.received.remove(at)?;
        self.waiting -= size;
        Some(incoming)
    }

    /// Drops late answers to requests before this one, whose calls have ended.
    fn drop_answers_before(&mut self, number: u64) {
        self.received.retain(|Received { incoming, size }| {
            let is_late = matches!(incoming, Incoming::Answer(Some(n), _) if *n < number);
            if is_late {
                self.waiting -= size;
            }
            !is_late
        });
    }

    /// Reads until `find` finds something, at most for `limit`, even while messages go on arriving.
    fn until<T>(
        &mut self,
        limit: Duration,
        mut find: impl FnMut(&mut Self) -> Option<T>,
    ) -> Result<T, CallError> {
        let end = Instant::now() + limit;
        let mut is_over = false;
        loop {
            if let Some(found) = find(self) {
                return Ok(found);
            }
            if is_over {
                return Err(CallError::TimedOut(limit));
            }
            self.wait(end, limit)?;
            is_over = Instant::now() >= end;
        }
    }

    /// Waits until something can be read or written, and does so.
    fn wait(&mut self, end: Instant, limit: Duration) -> Result<(), CallError> {
        if self.closed {
            return Err(CallError::Closed);
        }
        let left = end.saturating_duration_since(Instant::now());
        let timeout = Timespec::try_from(left).ok();
        let events = if self.has_output() {
            PollFlags::IN | PollFlags::OUT
        } else {
            PollFlags::IN
        };
        let mut polled = [PollFd::new(&self.stream, events)];
        match poll(&mut polled, timeout.as_ref()) {
            Ok(0) => return Err(CallError::TimedOut(limit)),
            Ok(_) | Err(Errno::INTR) => {}
            Err(error) => return Err(CallError::Io(error.into())),
        }
        self.turn();
        if self.waiting > MOST_WAITING {
            let reason = format!("more than {MOST_WAITING} bytes of other messages came");
            return Err(CallError::Io(io::Error::other(reason)));
        }
        Ok(())
    }

    fn turn(&mut self) {
        if self.output.write(&self.stream).is_err() {
            // The other side has closed, but may have answered before; only reading shows that.
            self.output.clear();
        }
        let (lines, ended) = self.lines.read(&self.stream);
        self.closed |= ended;
        for line in lines {
            let size = size_of::<Received>() + line.bytes().map_or(0, <[u8]>::len);
            let incoming = incoming(line);
            self.received.push_back(Received { incoming, size });
            self.waiting += size;
        }
        if self.waiting > MOST_WAITING {
            self.closed = true;
            let _ = self.stream.shutdown(Shutdown::Both);
        }
    }
}

impl AsFd for Client {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.stream.as_fd()
    }
}

fn incoming(line: Line) -> Incoming {
    let Line::Complete(line) = line else {
        return Incoming::Unknown(format!("a message of more than {LONGEST} bytes"));
    };
    let unknown = || Incoming::Unknown(clean_bytes(&line));
    let Ok(mut message) = serde_json::from_slice::<Value>(&line) else {
        return unknown();
    };
    if let Some(method) = message["method"].as_str() {
        let method = method.to_owned();
        return Incoming::Notification(method, message["params"].take());
    }
    let number = message["id"].as_u64();
    if let Some(result) = message.get_mut("result") {
        return Incoming::Answer(number, Ok(result.take()));
    }
    match Error::deserialize(&message["error"]) {
        Ok(error) => Incoming::Answer(number, Err(error)),
        Err(_) => unknown(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::component::{Done, Request};
    use std::io::{BufRead, BufReader, Write};
    use std::os::unix::net::UnixListener;

    const LIMIT: Duration = Duration::from_secs(10);
    const SHORT: Duration = Duration::from_millis(100);

    /// A client, and the messages that a server received which answers one request with `answer`.
    fn served(answer: &'static [u8]) -> (Client, std::thread::JoinHandle<String>) {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.sock");
        let listener = UnixListener::bind(&path).expect("a socket");
        let client = Client::connect(&path, LIMIT).expect("a connection");
        let server = std::thread::spawn(move || {
            let (mut stream, _) = listener.accept().expect("a client");
            let mut line = String::new();
            let mut input = BufReader::new(stream.try_clone().expect("a socket"));
            input.read_line(&mut line).expect("a request");
            stream.write_all(answer).expect("answered");
            line
        });
        (client, server)
    }

    #[test]
    fn a_call_finds_its_reply_among_notifications() {
        let (mut client, server) = served(
            b"{\"method\":\"event\",\"params\":7}\n{\"id\":9,\"result\":0}\n{\"id\":1,\"result\":{}}\n",
        );
        let answer: Result<Done, _> = client.call(&Request::Stop, LIMIT);
        assert!(answer.is_ok(), "{answer:?}");
        let event = Incoming::Notification("event".to_owned(), 7.into());
        assert_eq!(client.next(LIMIT).expect("an event"), event);
        assert!(matches!(
            client.next(LIMIT),
            Ok(Incoming::Answer(Some(9), Ok(_)))
        ));
        assert!(matches!(client.next(LIMIT), Err(CallError::Closed)));
        assert_eq!(
            server.join().expect("the server"),
            "{\"id\":1,\"jsonrpc\":\"2.0\",\"method\":\"stop\",\"params\":{}}\n"
        );
    }

    #[test]
    fn errors_and_invalid_replies_end_a_call() {
        let call = |answer| served(answer).0.call::<Done>(&Request::Stop, LIMIT);
        let refused = call(b"{\"error\":{\"code\":-32602,\"message\":\"too long\"},\"id\":null}\n");
        assert!(matches!(refused, Err(CallError::Refused(error)) if error.message == "too long"));
        assert!(matches!(call(b"hello\n"), Err(CallError::Unexpected(text)) if text == "hello"));
        assert!(matches!(
            call(b"{\"id\":1,\"result\":7}\n"),
            Err(CallError::Unexpected(_))
        ));
        assert!(matches!(call(b""), Err(CallError::Closed)));
    }

    #[test]
    fn what_has_arrived_is_received_without_waiting_until_the_connection_closes() {
        let (mut client, server) = served(b"{\"id\":1,\"result\":{}}\n");
        assert!(matches!(client.receive(), (incoming, true) if incoming.is_empty()));
        client.send(&Request::Stop);
        server.join().expect("the server");
        let (incoming, _) = client.receive();
        assert!(matches!(incoming[..], [Incoming::Answer(Some(1), Ok(_))]));
        while client.next(LIMIT).is_ok() {}
        assert!(matches!(client.receive(), (incoming, false) if incoming.is_empty()));
    }

    /// A client, and a server that writes `line` until the connection closes.
    fn flooded(line: &'static [u8]) -> (Client, std::thread::JoinHandle<()>) {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.sock");
        let listener = UnixListener::bind(&path).expect("a socket");
        let client = Client::connect(&path, LIMIT).expect("a connection");
        let server = std::thread::spawn(move || {
            let (mut stream, _) = listener.accept().expect("a client");
            while stream.write_all(line).is_ok() {}
        });
        (client, server)
    }

    #[test]
    fn endless_notifications_do_not_extend_a_call() {
        // The call drops these, so that only its limit ends it.
        let (mut client, server) = flooded(b"{\"id\":0,\"result\":{}}\n");
        let begin = Instant::now();
        let answer = client.call::<Done>(&Request::Stop, SHORT);
        assert!(matches!(answer, Err(CallError::TimedOut(SHORT))));
        assert!(begin.elapsed() < LIMIT);
        assert_eq!(client.waiting, 0);
        drop(client);
        server.join().expect("the server");

        let (mut client, server) = flooded(b"{\"method\":\"event\",\"params\":7}\n");
        let answer = client.call::<Done>(&Request::Stop, Duration::from_mins(1));
        assert!(matches!(answer, Err(CallError::Io(_))), "{answer:?}");
        // The other side learns that the connection is closed.
        server.join().expect("the server");
        while client.next(Duration::ZERO).is_ok() {}
        assert_eq!(client.waiting, 0);
        assert!(matches!(client.next(SHORT), Err(CallError::Closed)));
    }

    #[test]
    fn messages_that_wait_have_a_bound_in_bytes() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.sock");
        let listener = UnixListener::bind(&path).expect("a socket");
        let mut client = Client::connect(&path, LIMIT).expect("a connection");
        let line = format!("{{\"method\":\"{}\"}}\n", "x".repeat(1 << 18));
        let most = 3 * MOST_WAITING / line.len();
        let server = std::thread::spawn(move || {
            let (mut stream, _) = listener.accept().expect("a client");
            let lines = std::iter::repeat_n(line, most);
            lines
                .take_while(|line| stream.write_all(line.as_bytes()).is_ok())
                .count()
        });
        let answer = client.call::<Done>(&Request::Stop, Duration::from_mins(5));
        assert!(matches!(answer, Err(CallError::Io(_))), "{answer:?}");
        assert!(server.join().expect("the server") < most);
    }

    #[test]
    fn connecting_and_calling_have_time_limits() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.sock");
        let connect = |limit| Client::connect(&path, limit).map_err(|error| error.kind());
        assert_eq!(connect(SHORT).err(), Some(io::ErrorKind::NotFound));
        let _listener = UnixListener::bind(&path).expect("a socket");
        let mut client = connect(SHORT).expect("a connection");
        let answer = client.call::<Done>(&Request::Stop, SHORT);
        assert!(matches!(answer, Err(CallError::TimedOut(SHORT))));
        // The queue of the listener has a bound.
        let mut waiting = Vec::new();
        let refused = loop {
            match connect(SHORT) {
                Ok(client) => waiting.push(client),
                Err(kind) => break kind,
            }
        };
        assert_eq!(refused, io::ErrorKind::WouldBlock);
        assert_eq!(
            connect(Duration::ZERO).err(),
            Some(io::ErrorKind::WouldBlock)
        );
    }
}
