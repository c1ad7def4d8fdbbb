//! The supervisor's own socket: `status`, `events`, `down`, and `start`, `stop`, `restart {"names": [NAME, …]}`, as
//! JSON-RPC 2.0 lines.
//!
//! Who asks for `events` gets those that are kept and all that come, a notification each: `event`, or `missed {"events"}`
//! where it reads so slowly that some were given up.
//!
//! It only speaks; what the answers are is the supervisor's business. A client that does not read its
//! answers is dropped.

use crate::client::lines::{Line, Lines, Overlong};
use crate::client::status::Status;
use crate::log::journal::Journal;
use crate::supervisor::commands::{CommandResult, Verb};
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
/// How much of it may be events; the others wait in the journal.
const EVENTS_WAITING: usize = 64 << 10;

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
    /// How many answers it waits for that take their time; the end of the network is one, too.
    awaits: u32,
    /// It follows the events; the number of its next.
    next_event: Option<u64>,
}

/// What a client wants.
#[derive(Debug)]
pub(crate) struct Request {
    client: u64,
    id: Value,
    pub(crate) call: Call,
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Call {
    Status,
    Events,
    Down,
    /// The names are of components or groups, and may be wrong.
    Command(Verb, Vec<String>),
}

/// The parameters are wrong.
const INPUT: i32 = -32602;

#[derive(Deserialize)]
struct Incoming {
    #[serde(default)]
    id: Value,
    method: String,
    #[serde(default)]
    params: Value,
}

/// What a method means; the error has the code of JSON-RPC and is for people.
fn call(method: &str, params: &Value) -> Result<Call, (i32, String)> {
    match method {
        "status" => return Ok(Call::Status),
        "events" => return Ok(Call::Events),
        "down" => return Ok(Call::Down),
        _ => {}
    }
    let Some(verb) = Verb::of(method) else {
        let text = format!(
            "unknown method {method}; there are status, events, down, start, stop and restart"
        );
        return Err((-32601, text));
    };
    let names = params.get("names").and_then(Value::as_array);
    let names: Option<Vec<String>> = names
        .into_iter()
        .flatten()
        .map(|name| name.as_str().map(str::to_owned))
        .collect();
    match names.filter(|names| !names.is_empty()) {
        Some(names) => Ok(Call::Command(verb, names)),
        None => Err((
            INPUT,
            format!("`{method}` takes {{\"names\": [\"lidar\", …]}}"),
        )),
    }
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

    /// Whether there were new events for it.
    fn take_events(&mut self, journal: &Journal) -> bool {
        let Some(mut next) = self.next_event else {
            return false;
        };
        let mut told = false;
        while self.out.len() < EVENTS_WAITING
            && let Some(event) = journal.get(next)
        {
            let (method, params, count) = match event {
                Ok(event) => ("event", event.clone(), 1),
                Err(missed) => ("missed", json!({"events": missed}), missed),
            };
            self.send(&json!({"jsonrpc": "2.0", "method": method, "params": params}));
            next += count;
            told = true;
        }
        self.next_event = Some(next);
        told
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
            let Some(Incoming { id, method, params }) = parsed else {
                self.send(&error(
                    &Value::Null,
                    -32700,
                    "not a request in JSON-RPC 2.0",
                ));
                continue;
            };
            let call = match call(&method, &params) {
                Ok(call) => call,
                Err((code, text)) => {
                    self.send(&error(&id, code, &text));
                    continue;
                }
            };
            self.awaits += u32::from(call != Call::Status);
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

    /// Lets one client in. If there are too many, the oldest goes that does not wait for an answer.
    pub(crate) fn accept(&mut self) {
        let Ok((stream, _)) = self.listener.accept() else {
            return;
        };
        if stream.set_nonblocking(true).is_err() {
            return;
        }
        if self.clients.len() >= CLIENTS {
            let oldest = self.clients.iter().position(|c| c.awaits == 0);
            self.clients.remove(oldest.unwrap_or(0));
        }
        self.clients.push(Client {
            number: self.next,
            stream,
            lines: Lines::new(Overlong::Skip),
            out: Vec::new(),
            awaits: 0,
            next_event: None,
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
        self.answer(request, &result(&request.id, &json!(status)), 0);
    }

    /// Answers `events`; they follow with [`Self::tell`].
    pub(crate) fn answer_events(&mut self, request: &Request, journal: &Journal) {
        let (kept, first) = journal.kept();
        self.answer(request, &result(&request.id, &json!({"kept": kept})), 0);
        let found = self.clients.iter_mut().find(|c| c.number == request.client);
        if let Some(client) = found {
            client.next_event = Some(first);
        }
    }

    /// Hands new events to those who follow them, as fast as they read.
    pub(crate) fn tell(&mut self, journal: &Journal) {
        self.clients.retain_mut(|client| {
            let told = client.take_events(journal);
            !told || client.write()
        });
    }

    /// Answers `down`: the connection closes when all is down.
    pub(crate) fn answer_down(&mut self, request: &Request) {
        self.answer(request, &result(&request.id, &json!({"stopping": true})), 0);
    }

    /// Answers a command that was carried out as far as it could be.
    pub(crate) fn answer_command(&mut self, request: &Request, outcome: &CommandResult) {
        self.answer(request, &result(&request.id, &json!(outcome)), 1);
    }

    /// Answers a command whose names are wrong.
    pub(crate) fn answer_refused(&mut self, request: &Request, reason: &str) {
        self.answer(request, &error(&request.id, INPUT, reason), 1);
    }

    /// Sends an answer; `awaited` of those that took their time.
    fn answer(&mut self, request: &Request, answer: &Value, awaited: u32) {
        let found = self.clients.iter_mut().find(|c| c.number == request.client);
        let Some(client) = found else { return };
        client.awaits = client.awaits.saturating_sub(awaited);
        if !request.id.is_null() {
            client.send(answer);
        }
        if !client.write() {
            self.clients.retain(|c| c.number != request.client);
        }
    }
}

fn result(id: &Value, result: &Value) -> Value {
    json!({"jsonrpc": "2.0", "id": id, "result": result})
}
