//! The server of a management socket. Nothing that a client does or omits delays its owner, or
//! another client.
//!
//! | a client that | |
//! |---|---|
//! | sends many requests | has one of them served in each turn of the owner's loop |
//! | does not take an answer | is not served on, and is dropped five seconds after the answer |
//! | is idle, and follows nothing | gives way to a new one where there are too many, the longest idle first |
//! | cannot be accepted | waits; the owner sleeps meanwhile |

use crate::client::LONGEST;
use crate::lines::{LIMIT, Line, Lines, Overlong};
use crate::listener::Listener;
use crate::output::Output;
use crate::rpc::{self, Call, Error};
use rustix::event::PollFlags;
use rustix::net::sockopt::socket_peercred;
use rustix::process::Pid;
use serde_json::Value;
use std::collections::VecDeque;
use std::io;
use std::os::fd::{AsFd, BorrowedFd};
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::time::{Duration, Instant};

/// How many clients may be connected at once.
pub const MAX_CLIENTS: usize = 32;
/// How many bytes of output may wait for one client: the longest message that [`crate::Client`]
/// accepts, and an answer after it.
const MAX_OUTPUT: usize = LONGEST + (1 << 20);
/// How long a client may take to read an answer.
const PATIENCE: Duration = Duration::from_secs(5);
/// How many requests of one client may wait for answers that take their time.
const MAX_DEFERRED: usize = 16;

/// A listening socket and its clients. `T` is the state that the owner keeps for a client.
///
/// In each turn of its loop, the owner polls [`Server::descriptors`] until [`Server::deadline`],
/// passes the ready ones to [`Server::turn`], serves [`Server::requests`], and calls
/// [`Server::check`].
#[derive(Debug)]
pub struct Server<T = ()> {
    /// Dropped before the clients: a client whose connection closes may listen at the same place.
    listeners: Vec<Listener>,
    clients: Vec<ServedClient<T>>,
    /// The number of the next client.
    next: u64,
    /// The process that always has a place.
    supervisor: Option<Pid>,
}

/// A descriptor of a server.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ServerSource {
    /// The listening socket with this number.
    Listener(usize),
    /// The client with this number.
    Client(u64),
}

/// A received request.
#[derive(Clone, Debug, PartialEq)]
pub struct Received {
    /// The number of the client.
    pub client: u64,
    /// The request, or why there is none; [`Server::answer`] that with a null identifier.
    pub call: Result<Call, Error>,
}

/// A connected client.
#[derive(Debug)]
pub struct ServedClient<T> {
    number: u64,
    stream: UnixStream,
    is_supervisor: bool,
    lines: Lines,
    /// Requests that were read and not served.
    requests: VecDeque<Line>,
    output: Output,
    /// How many answers it waits for that take their time.
    deferred: usize,
    /// Whether it sends nothing any more.
    has_ended: bool,
    /// Whether it reads nothing any more.
    is_gone: bool,
    /// When it connected, or when its last request came.
    active: Instant,
    /// Whether it waits for notifications. Then it keeps its place although it requests nothing.
    pub follows: bool,
    /// State that the owner keeps for the client.
    pub state: T,
}

impl<T: Default> Server<T> {
    /// Listens at `path`, which must not exist.
    pub fn bind(path: &Path) -> io::Result<Self> {
        Ok(Self {
            listeners: vec![Listener::bind(path)?],
            clients: Vec::new(),
            next: 0,
            supervisor: None,
        })
    }

    /// Also listens there.
    pub fn add(&mut self, listener: Listener) {
        self.listeners.push(listener);
    }

    /// Listens at its path again if the socket is not there any more, and stays connected with its
    /// clients. Returns whether it was not. The caller owns the path.
    pub fn restore(&mut self) -> io::Result<bool> {
        let mut restored = false;
        for listener in &mut self.listeners {
            restored |= listener.restore()?;
        }
        Ok(restored)
    }

    /// Reserves a place for this process: its only connection never gives way to another one.
    pub fn reserve(&mut self, supervisor: Pid) {
        self.supervisor = Some(supervisor);
    }

    /// The descriptors to wait for.
    pub fn descriptors(&self) -> impl Iterator<Item = (ServerSource, BorrowedFd<'_>, PollFlags)> {
        let listeners = self.listeners.iter().enumerate();
        let listeners = listeners.filter_map(|(at, listener)| {
            let fd = listener.descriptor()?;
            Some((ServerSource::Listener(at), fd, PollFlags::IN))
        });
        let clients = self.clients.iter().map(|client| {
            let source = ServerSource::Client(client.number);
            (source, client.stream.as_fd(), client.flags())
        });
        listeners.chain(clients)
    }

    /// When the passing of time next matters. It is past while requests wait to be served.
    pub fn deadline(&self) -> Option<Instant> {
        let clients = self.clients.iter();
        let clients = clients.filter_map(|client| {
            if client.may_be_served() && !client.requests.is_empty() {
                Some(client.active)
            } else {
                client.output.deadline()
            }
        });
        let listeners = self.listeners.iter().filter_map(Listener::deadline);
        clients.chain(listeners).min()
    }

    /// Accepts a client, or reads from and writes to one, after `poll` returned these events.
    pub fn turn(&mut self, source: ServerSource, events: PollFlags) {
        match source {
            ServerSource::Listener(at) => self.accept(at),
            ServerSource::Client(number) => self.with(number, |client| client.turn(events)),
        }
    }

    /// Takes at most one request of each client.
    pub fn requests(&mut self) -> Vec<Received> {
        let clients = self.clients.iter_mut();
        let served = clients.filter(|client| client.may_be_served());
        served
            .filter_map(|client| {
                let call = match client.requests.pop_front()? {
                    Line::Complete(line) => Call::parse(&line),
                    Line::TooLong => {
                        let message = format!("a request has at most {} KiB", LIMIT / 1024);
                        Err(Error::new(Error::INVALID_PARAMS, message))
                    }
                };
                Some(Received {
                    client: client.number,
                    call,
                })
            })
            .collect()
    }

    /// Answers a request.
    pub fn answer(&mut self, client: u64, id: &Value, result: Result<Value, Error>) {
        let mut line = rpc::answer(id, result);
        if line.len() > LONGEST {
            let message = format!(
                "the answer has more than {} MiB; ask for less at once",
                LONGEST >> 20
            );
            line = rpc::answer(id, Err(Error::new(Error::SYSTEM, message)));
        }
        self.with(client, |client| {
            let deadline = Instant::now() + PATIENCE;
            client.output.push_until(&line, deadline);
            client.write()
        });
    }

    /// Notes that the answer to a request takes its time. [`Server::settle`] follows.
    pub fn defer(&mut self, client: u64) {
        self.with(client, |client| {
            client.deferred += 1;
            true
        });
    }

    /// Notes that a deferred answer is due: [`Server::answer`] follows, except for a notification.
    pub fn settle(&mut self, client: u64) {
        self.with(client, |client| {
            client.deferred = client.deferred.saturating_sub(1);
            true
        });
    }

    /// Sets the owner's state of a client.
    pub fn set_state(&mut self, client: u64, state: T) {
        self.with(client, |client| {
            client.state = state;
            true
        });
    }

    /// The client with this number, if it is still there.
    pub fn client_mut(&mut self, number: u64) -> Option<&mut ServedClient<T>> {
        self.clients.iter_mut().find(|c| c.number == number)
    }

    /// The clients.
    pub fn clients_mut(&mut self) -> impl Iterator<Item = &mut ServedClient<T>> {
        self.clients.iter_mut()
    }

    /// Writes to each client as much as it accepts at once.
    pub fn flush(&mut self) {
        self.clients.retain_mut(ServedClient::write);
    }

    /// Handles the passing of time, and drops clients that have ended.
    pub fn check(&mut self, now: Instant) {
        for listener in &mut self.listeners {
            listener.resume(now);
        }
        self.clients.retain_mut(|client| {
            let is_due = client.output.deadline().is_some_and(|at| now >= at);
            (!is_due || client.write()) && !client.is_over()
        });
    }

    /// Drops the client with this number if `turn` returns false.
    fn with(&mut self, number: u64, turn: impl FnOnce(&mut ServedClient<T>) -> bool) {
        let found = self.clients.iter().position(|c| c.number == number);
        if let Some(at) = found
            && !turn(&mut self.clients[at])
        {
            self.clients.remove(at);
        }
    }

    fn accept(&mut self, at: usize) {
        let Some(stream) = self.listeners.get_mut(at).and_then(Listener::accept) else {
            return;
        };
        if self.clients.len() >= MAX_CLIENTS {
            self.make_room();
        }
        let peer = socket_peercred(&stream).ok().map(|peer| peer.pid);
        self.clients.push(ServedClient {
            number: self.next,
            stream,
            is_supervisor: peer.is_some() && peer == self.supervisor,
            lines: Lines::new(Overlong::Skip),
            requests: VecDeque::new(),
            output: Output::up_to(MAX_OUTPUT),
            deferred: 0,
            has_ended: false,
            is_gone: false,
            active: Instant::now(),
            follows: false,
            state: T::default(),
        });
        self.next += 1;
    }

    /// Drops the client that has been idle the longest. One that follows notifications, or waits
    /// for an answer, is dropped only if all are such; then the least recent one.
    fn make_room(&mut self) {
        let of_supervisor = self.clients.iter().filter(|c| c.is_supervisor).count();
        let clients = self.clients.iter().enumerate();
        let others = clients.filter(|(_, c)| of_supervisor > 1 || !c.is_supervisor);
        let oldest = others.min_by_key(|(_, c)| (c.follows || !c.is_idle(), c.active));
        if let Some((at, _)) = oldest {
            self.clients.remove(at);
        }
    }
}

impl<T> ServedClient<T> {
    /// How many bytes of output wait.
    pub fn waiting(&self) -> usize {
        self.output.len()
    }

    /// Whether it reads no more answers. Requests that it sent before may still be served.
    pub fn is_gone(&self) -> bool {
        self.is_gone
    }

    /// Queues a notification, for which there is no deadline. [`Server::flush`] writes it.
    pub fn push(&mut self, notification: &[u8]) {
        self.output.push(notification);
    }

    /// Whether its next request may be served: it has taken all answers but a few that take time.
    fn may_be_served(&self) -> bool {
        self.output.deadline().is_none() && self.deferred < MAX_DEFERRED
    }

    fn reads(&self) -> bool {
        !self.has_ended && self.requests.is_empty() && self.may_be_served()
    }

    fn is_idle(&self) -> bool {
        self.requests.is_empty() && self.output.is_empty() && self.deferred == 0
    }

    fn is_over(&self) -> bool {
        self.has_ended && self.is_idle()
    }

    fn flags(&self) -> PollFlags {
        let mut flags = PollFlags::empty();
        flags.set(PollFlags::IN, self.reads());
        flags.set(PollFlags::OUT, !self.output.is_empty());
        flags
    }

    /// Reads and writes; false if the client is over.
    fn turn(&mut self, events: PollFlags) -> bool {
        if events.intersects(PollFlags::HUP | PollFlags::ERR | PollFlags::NVAL) {
            self.expects_nothing();
        }
        if !self.write() {
            return false;
        }
        if self.reads() {
            let (lines, ended) = self.lines.read(&self.stream);
            if ended {
                // A request without an end of line is not complete.
                self.has_ended = true;
            } else if !lines.is_empty() {
                self.active = Instant::now();
                self.requests.extend(lines);
            }
        }
        !self.is_over()
    }

    /// Writes as much as the client accepts at once; false if it has not read in time.
    fn write(&mut self) -> bool {
        match self.output.write(&self.stream) {
            Ok(()) => true,
            Err(error) => {
                let is_slow = matches!(
                    error.kind(),
                    io::ErrorKind::TimedOut | io::ErrorKind::OutOfMemory
                );
                self.expects_nothing();
                !is_slow
            }
        }
    }

    /// It reads no more replies. Requests that it sent before still count.
    fn expects_nothing(&mut self) {
        self.is_gone = true;
        self.output.clear();
        self.deferred = 0;
    }
}
