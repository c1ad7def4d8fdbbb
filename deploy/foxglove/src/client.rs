//! A client: its handshake, its received messages, and its output queue.

use crate::origin;
use crate::protocol::{self, Level, SUBPROTOCOLS};
use crate::queue::Queue;
use crate::subscriptions::Subscriptions;
use rc_diagnostics::foreign::clean;
use rustix::event::PollFlags;
use serde_json::Value as Json;
use std::collections::BTreeSet;
use std::io::ErrorKind;
use std::net::TcpStream;
use std::os::fd::{AsFd, BorrowedFd};
use std::sync::Arc;
use std::time::{Duration, Instant};
use tungstenite::handshake::server::{Callback, ErrorResponse, Request, Response, ServerHandshake};
use tungstenite::handshake::{HandshakeError, MidHandshake};
use tungstenite::http::{HeaderValue, StatusCode};
use tungstenite::protocol::WebSocketConfig;
use tungstenite::{Error, Message, WebSocket};

/// How long the handshake may take.
const GREETING: Duration = Duration::from_secs(5);
/// After how much silence a client is asked for a sign of life, and after how much it is closed.
const SILENCE: Duration = Duration::from_secs(10);
const DEAD: Duration = Duration::from_secs(30);
/// The longest message of a client, in bytes.
const LONGEST: usize = 4 << 20;
/// How many messages of a client are handled in a turn, and how many bytes if it is several.
const TURN: usize = 64;
const TURN_BYTES: usize = 256 << 10;
/// How often a client is told that messages were lost.
const REPORT: Duration = Duration::from_secs(1);

/// Judges the handshake: the version of the protocol, and the origin of a web page.
struct Gate {
    origins: Arc<[String]>,
}

impl Callback for Gate {
    fn on_request(
        self,
        request: &Request,
        mut response: Response,
    ) -> Result<Response, ErrorResponse> {
        let refuse = |status: StatusCode, reason: &str| {
            let mut refusal = ErrorResponse::new(Some(reason.to_owned()));
            *refusal.status_mut() = status;
            refusal
        };
        let mut origins = request.headers().get_all("origin").iter();
        if !origins.all(|origin| {
            let origin = origin.to_str();
            origin.is_ok_and(|origin| origin::is_allowed(origin, &self.origins))
        }) {
            let reason = "web pages of this origin are not served; `--origin` allows them";
            return Err(refuse(StatusCode::FORBIDDEN, reason));
        }
        let offered = request.headers().get_all("sec-websocket-protocol").iter();
        let offered: Vec<&str> = offered
            .filter_map(|header| header.to_str().ok())
            .flat_map(|header| header.split(',').map(str::trim))
            .collect();
        let spoken = SUBPROTOCOLS.iter().find(|own| offered.contains(own));
        let Some(spoken) = spoken else {
            let reason = format!("expected one of the protocols {}", SUBPROTOCOLS.join(", "));
            return Err(refuse(StatusCode::BAD_REQUEST, &reason));
        };
        let header = HeaderValue::from_static(spoken);
        response
            .headers_mut()
            .insert("sec-websocket-protocol", header);
        Ok(response)
    }
}

enum Link {
    Greeting(Box<MidHandshake<ServerHandshake<TcpStream, Gate>>>),
    Open(Box<WebSocket<TcpStream>>),
    Closed,
}

/// A client.
pub(crate) struct Client {
    link: Link,
    since: Instant,
    heard: Instant,
    asked: Instant,
    waiting: Queue,
    /// How many messages may be received in this turn, and how many bytes.
    turn: (usize, usize),
    /// Whether the socket has not taken a message to its end.
    is_writing: bool,
    lost: u64,
    reported: (u64, Instant),
    pub(crate) subscriptions: Subscriptions,
    /// Parameters whose changes it wants to know; none for all.
    pub(crate) watched: Option<BTreeSet<String>>,
    pub(crate) watches_graph: bool,
}

impl Client {
    /// A client that has connected.
    pub(crate) fn accept(stream: TcpStream, origins: &Arc<[String]>) -> Option<Self> {
        stream.set_nonblocking(true).ok()?;
        // A message is whole when it is written.
        stream.set_nodelay(true).ok()?;
        let gate = Gate {
            origins: Arc::clone(origins),
        };
        let config = WebSocketConfig::default()
            .read_buffer_size(16 << 10)
            .write_buffer_size(0)
            .max_message_size(Some(LONGEST))
            .max_frame_size(Some(LONGEST));
        let greeting = tungstenite::accept_hdr_with_config(stream, gate, Some(config));
        let now = Instant::now();
        let mut client = Self {
            link: Link::Closed,
            since: now,
            heard: now,
            asked: now,
            waiting: Queue::default(),
            turn: (TURN, TURN_BYTES),
            is_writing: false,
            lost: 0,
            reported: (0, now),
            subscriptions: Subscriptions::default(),
            watched: Some(BTreeSet::new()),
            watches_graph: false,
        };
        client.link = Self::greeted(greeting);
        Some(client)
    }

    fn greeted(
        greeting: Result<WebSocket<TcpStream>, HandshakeError<ServerHandshake<TcpStream, Gate>>>,
    ) -> Link {
        match greeting {
            Ok(open) => Link::Open(Box::new(open)),
            Err(HandshakeError::Interrupted(greeting)) => Link::Greeting(Box::new(greeting)),
            Err(HandshakeError::Failure(_)) => Link::Closed,
        }
    }

    /// Goes on with the handshake. Says whether it has just ended well.
    pub(crate) fn greet(&mut self) -> bool {
        match std::mem::replace(&mut self.link, Link::Closed) {
            Link::Greeting(greeting) => {
                if self.since.elapsed() < GREETING {
                    self.link = Self::greeted(greeting.handshake());
                }
                self.is_open()
            }
            other @ (Link::Open(_) | Link::Closed) => {
                self.link = other;
                false
            }
        }
    }

    pub(crate) fn is_open(&self) -> bool {
        matches!(self.link, Link::Open(_))
    }

    pub(crate) fn is_closed(&self) -> bool {
        matches!(self.link, Link::Closed)
    }

    /// The socket, and what to wait for.
    pub(crate) fn polled(&self) -> Option<(BorrowedFd<'_>, PollFlags)> {
        match &self.link {
            Link::Greeting(greeting) => Some((greeting.get_ref().get_ref().as_fd(), PollFlags::IN)),
            Link::Open(open) => {
                let mut flags = PollFlags::IN;
                if self.is_writing || !self.waiting.is_empty() {
                    flags |= PollFlags::OUT;
                }
                Some((open.get_ref().as_fd(), flags))
            }
            Link::Closed => None,
        }
    }

    /// Begins a turn, in which a part of the client's messages is received.
    pub(crate) fn begin_turn(&mut self) {
        self.turn = (TURN, TURN_BYTES);
    }

    /// Whether messages of its last turn may be left.
    pub(crate) fn has_more(&self) -> bool {
        self.is_open() && (self.turn.0 == 0 || self.turn.1 == 0)
    }

    /// Receives a message of this turn.
    pub(crate) fn receive(&mut self) -> Option<Message> {
        loop {
            let Link::Open(open) = &mut self.link else {
                return None;
            };
            if self.turn.0 == 0 || self.turn.1 == 0 {
                return None;
            }
            match open.read() {
                Ok(message) => {
                    self.heard = Instant::now();
                    self.turn.0 -= 1;
                    self.turn.1 = self.turn.1.saturating_sub(message.len());
                    if matches!(message, Message::Text(_) | Message::Binary(_)) {
                        return Some(message);
                    }
                }
                Err(Error::Io(error)) if error.kind() == ErrorKind::WouldBlock => return None,
                Err(_) => {
                    self.link = Link::Closed;
                    return None;
                }
            }
        }
    }

    /// Sends a document, as soon as there is room.
    pub(crate) fn send(&mut self, document: &Json) {
        self.control(Message::text(document.to_string()));
    }

    /// Sends a binary message that is none of a channel.
    pub(crate) fn send_binary(&mut self, message: Vec<u8>) {
        self.control(Message::binary(message));
    }

    fn control(&mut self, message: Message) {
        if self.is_open() && self.waiting.control(message).is_err() {
            // It asks and does not read.
            self.close();
        }
    }

    fn close(&mut self) {
        self.link = Link::Closed;
        self.waiting = Queue::default();
    }

    /// Sends a message of a channel. The oldest ones are lost if too much waits.
    pub(crate) fn publish(&mut self, message: Vec<u8>) {
        if self.is_open() {
            self.lost += self.waiting.sample(Message::binary(message));
        }
    }

    /// Counts messages that were lost on their way to this program.
    pub(crate) fn note_loss(&mut self, count: u64) {
        self.lost += count;
    }

    /// Reports a failure to the user of the client.
    pub(crate) fn complain(&mut self, text: &str) {
        self.send(&protocol::status(Level::Error, &clean(text), None));
    }

    /// Writes as much as the socket accepts.
    pub(crate) fn flush(&mut self) {
        if self.lost > self.reported.0 && self.reported.1.elapsed() >= REPORT {
            self.reported = (self.lost, Instant::now());
            let text = format!("{} messages were lost on their way here", self.lost);
            self.send(&protocol::status(Level::Warning, &text, Some("lost")));
        }
        let is_silent = self.heard.elapsed() > SILENCE && self.asked.elapsed() > SILENCE;
        if self.is_open() && is_silent {
            self.asked = Instant::now();
            self.control(Message::Ping(tungstenite::Bytes::new()));
        }
        if self.write().is_err() || self.heard.elapsed() > DEAD {
            self.link = Link::Closed;
        }
    }

    fn write(&mut self) -> Result<(), Error> {
        let Link::Open(open) = &mut self.link else {
            return Ok(());
        };
        let blocks =
            |error: &Error| matches!(error, Error::Io(e) if e.kind() == ErrorKind::WouldBlock);
        loop {
            if self.is_writing {
                match open.flush() {
                    Ok(()) => self.is_writing = false,
                    Err(error) if blocks(&error) => return Ok(()),
                    Err(error) => return Err(error),
                }
            }
            let Some(message) = self.waiting.pop() else {
                return Ok(());
            };
            self.is_writing = true;
            match open.write(message) {
                Ok(()) => {}
                Err(error) if blocks(&error) => {}
                Err(error) => return Err(error),
            }
        }
    }
}
