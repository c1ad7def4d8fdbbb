//! The supervisor's own socket: `status` and `down`, as JSON-RPC 2.0 lines.
//!
//! It only speaks; what the answers are is the supervisor's business. A client that does not read its
//! answers is dropped.

use crate::lines::{Line, Lines, Overlong};
use crate::status::Status;
use serde::Deserialize;
use serde_json::{Value, json};
use std::io::{self, Write};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::Path;

/// The name that the supervisor's socket has in the run directory.
pub(crate) const NAME: &str = "rcdeploy";
/// How many clients may be connected at once.
const CLIENTS: usize = 16;
/// How much of an answer may wait for a client to read.
const WAITING: usize = 1 << 20;

/// The listening socket, and who is connected.
#[derive(Debug)]
pub(crate) struct Control {
    listener: UnixListener,
    clients: Vec<Client>,
    next: u64,
}

#[derive(Debug)]
pub(crate) struct Client {
    pub(crate) number: u64,
    pub(crate) stream: UnixStream,
    lines: Lines,
    out: Vec<u8>,
    /// It waits for its connection to close when all is down.
    awaits_end: bool,
}

/// What a client wants.
#[derive(Debug)]
pub(crate) struct Request {
    client: u64,
    id: Value,
    pub(crate) call: Call,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Call {
    Status,
    Down,
}

#[derive(Deserialize)]
struct Incoming {
    #[serde(default)]
    id: Value,
    method: String,
}

impl Client {
    /// Whether it is to be written to as soon as that is possible.
    pub(crate) fn has_output(&self) -> bool {
        !self.out.is_empty()
    }

    fn send(&mut self, message: &Value) {
        self.out.extend_from_slice(message.to_string().as_bytes());
        self.out.push(b'\n');
    }

    /// Writes what can be written; `false` if the client is lost.
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

    /// The requests that have come, and whether the client is still there.
    fn read(&mut self) -> (Vec<Request>, bool) {
        let (lines, closed) = self.lines.read(&self.stream);
        let mut requests = Vec::new();
        for line in lines {
            let parsed = match &line {
                Line::Text(text) => serde_json::from_str::<Incoming>(text).ok(),
                Line::TooLong => None,
            };
            let Some(Incoming { id, method }) = parsed else {
                self.send(&error(
                    &Value::Null,
                    -32700,
                    "not a request in JSON-RPC 2.0",
                ));
                continue;
            };
            let call = match method.as_str() {
                "status" => Call::Status,
                "down" => Call::Down,
                _ => {
                    let text = format!("unknown method {method}; there are status and down");
                    self.send(&error(&id, -32601, &text));
                    continue;
                }
            };
            requests.push(Request {
                client: self.number,
                id,
                call,
            });
        }
        (requests, !closed)
    }
}

fn error(id: &Value, code: i32, message: &str) -> Value {
    json!({"jsonrpc": "2.0", "id": id, "error": {"code": code, "message": message}})
}

impl Control {
    /// Listens at `path`, which is the caller's: whose socket is there was killed while it cleaned up.
    pub(crate) fn listen(path: &Path) -> io::Result<Self> {
        match std::fs::remove_file(path) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
            _ => {}
        }
        let listener = UnixListener::bind(path)?;
        listener.set_nonblocking(true)?;
        Ok(Self {
            listener,
            clients: Vec::new(),
            next: 0,
        })
    }

    pub(crate) fn listener(&self) -> &UnixListener {
        &self.listener
    }

    pub(crate) fn clients(&self) -> &[Client] {
        &self.clients
    }

    /// Lets one client in. If there are too many, the oldest goes that does not wait for the end.
    pub(crate) fn accept(&mut self) {
        let Ok((stream, _)) = self.listener.accept() else {
            return;
        };
        if stream.set_nonblocking(true).is_err() {
            return;
        }
        if self.clients.len() >= CLIENTS {
            let oldest = self.clients.iter().position(|c| !c.awaits_end);
            self.clients.remove(oldest.unwrap_or(0));
        }
        self.clients.push(Client {
            number: self.next,
            stream,
            lines: Lines::new(Overlong::Skip),
            out: Vec::new(),
            awaits_end: false,
        });
        self.next += 1;
    }

    /// Something can be read from or written to a client: what it wants.
    pub(crate) fn turn(&mut self, number: u64) -> Vec<Request> {
        let Some(index) = self.clients.iter().position(|c| c.number == number) else {
            return Vec::new();
        };
        let client = &mut self.clients[index];
        let (requests, there) = client.read();
        if !(client.write() && there) {
            self.clients.remove(index);
            // A `down` counts even if its sender did not wait for the answer.
            return requests;
        }
        requests
    }

    /// Answers `status`.
    pub(crate) fn answer_status(&mut self, request: &Request, status: &Status) {
        self.answer(request, &json!(status), false);
    }

    /// Answers `down`: the connection closes when all is down.
    pub(crate) fn answer_down(&mut self, request: &Request) {
        self.answer(request, &json!({"stopping": true}), true);
    }

    fn answer(&mut self, request: &Request, result: &Value, awaits_end: bool) {
        let found = self.clients.iter_mut().find(|c| c.number == request.client);
        let Some(client) = found else { return };
        client.awaits_end |= awaits_end;
        if !request.id.is_null() {
            client.send(&json!({"jsonrpc": "2.0", "id": request.id, "result": result}));
        }
        if !client.write() {
            self.clients.retain(|c| c.number != request.client);
        }
    }
}
