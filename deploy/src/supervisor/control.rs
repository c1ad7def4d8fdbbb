//! The supervisor's socket, `rcdeploy.sock` in the run directory.
//!
//! It decodes requests and sends answers and events; the supervisor decides what the answers are. A
//! client that does not read its answers is dropped. A client that reads events too slowly loses
//! some, and gets their number.

use crate::log::journal::Journal;
use crate::process::listener::Listener;
use rc_management::Output;
use rc_management::lines::{Line, Lines, Overlong};
use rc_management::rpc::{self, Call, Error};
use rc_management::supervisor::{
    CommandResult, KeptEvents, NetworkStatus, Notification, Request, Stopping,
};
use serde_json::Value;
use std::io;
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::time::Instant;

/// How many clients may be connected at once.
const MAX_CLIENTS: usize = 16;
/// How many bytes of output may wait for a client to read.
const MAX_OUTPUT: usize = 1 << 20;
/// How many bytes of it may be events; later events wait in the journal.
const MAX_EVENT_OUTPUT: usize = 64 << 10;

/// The listening socket and its clients.
#[derive(Debug)]
pub(crate) struct Control {
    listener: Listener,
    clients: Vec<Client>,
    next: u64,
}

#[derive(Debug)]
pub(crate) struct Client {
    pub(crate) number: u64,
    pub(crate) stream: UnixStream,
    lines: Lines,
    output: Output,
    /// How many answers it waits for that take their time; the end of the network is one, too.
    awaits: u32,
    /// The number of the next event for it, if it follows events.
    next_event: Option<u64>,
}

/// A request of a client.
#[derive(Debug)]
pub(crate) struct ClientRequest {
    client: u64,
    id: Option<Value>,
    pub(crate) request: Request,
}

impl Client {
    /// Whether output waits until the client reads.
    pub(crate) fn has_output(&self) -> bool {
        !self.output.is_empty()
    }

    /// Queues the new events. Returns whether there were any.
    fn take_events(&mut self, journal: &Journal) -> bool {
        let Some(mut next) = self.next_event else {
            return false;
        };
        let mut found = false;
        while self.output.len() < MAX_EVENT_OUTPUT
            && let Some(event) = journal.get(next)
        {
            let (notification, count) = match event {
                Ok(event) => (Notification::Event(event.clone()), 1),
                Err(missed) => (Notification::Missed { events: missed }, missed),
            };
            self.output.push(&rpc::notification(&notification));
            next += count;
            found = true;
        }
        self.next_event = Some(next);
        found
    }

    /// Writes what the client takes at once; `false` if the client is lost.
    fn write(&mut self) -> bool {
        self.output.write(&self.stream).is_ok() && self.output.len() <= MAX_OUTPUT
    }

    /// Reads once. Returns the requests, and whether the client is still there.
    fn read(&mut self) -> (Vec<ClientRequest>, bool) {
        let (lines, closed) = self.lines.read(&self.stream);
        let mut requests = Vec::new();
        for line in lines {
            let call = match &line {
                Line::Complete(line) => Call::parse(line),
                Line::TooLong => Err(Error::new(Error::PARSE, "a request has at most 64 KiB")),
            };
            let (id, request) = match call {
                Ok(call) => (call.id.clone(), Request::decode(call)),
                Err(error) => (Some(Value::Null), Err(error)),
            };
            match (request, id) {
                (Ok(request), id) => {
                    self.awaits += u32::from(request != Request::Status);
                    requests.push(ClientRequest {
                        client: self.number,
                        id,
                        request,
                    });
                }
                (Err(error), Some(id)) => self.output.push(&rpc::answer(&id, Err(error))),
                (Err(_), None) => {}
            }
        }
        (requests, !closed)
    }
}

impl Control {
    /// Listens at `path`, and replaces the socket of a supervisor that was killed. The caller owns
    /// the path.
    pub(crate) fn listen(path: &Path) -> io::Result<Self> {
        match std::fs::remove_file(path) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
            _ => {}
        }
        Ok(Self {
            listener: Listener::bind(path)?,
            clients: Vec::new(),
            next: 0,
        })
    }

    pub(crate) fn listener(&self) -> &Listener {
        &self.listener
    }

    /// Accepts clients again when a pause is over.
    pub(crate) fn resume(&mut self, now: Instant) {
        self.listener.resume(now);
    }

    pub(crate) fn clients(&self) -> &[Client] {
        &self.clients
    }

    /// Accepts one client. If there are too many, the oldest that does not wait for an answer is
    /// dropped.
    pub(crate) fn accept(&mut self) {
        let Some(stream) = self.listener.accept() else {
            return;
        };
        if self.clients.len() >= MAX_CLIENTS {
            let oldest = self.clients.iter().position(|c| c.awaits == 0);
            self.clients.remove(oldest.unwrap_or(0));
        }
        self.clients.push(Client {
            number: self.next,
            stream,
            lines: Lines::new(Overlong::Skip),
            output: Output::default(),
            awaits: 0,
            next_event: None,
        });
        self.next += 1;
    }

    /// Reads from and writes to a client whose socket is ready. Returns its requests.
    pub(crate) fn turn(&mut self, number: u64) -> Vec<ClientRequest> {
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
    pub(crate) fn answer_status(&mut self, request: &ClientRequest, status: &NetworkStatus) {
        self.answer(request, rpc::result(status), 0);
    }

    /// Answers `events`; the events follow with [`Self::send_events`].
    pub(crate) fn answer_events(&mut self, request: &ClientRequest, journal: &Journal) {
        let (kept, first) = journal.kept();
        self.answer(request, rpc::result(&KeptEvents { kept }), 0);
        let found = self.clients.iter_mut().find(|c| c.number == request.client);
        if let Some(client) = found {
            client.next_event = Some(first);
        }
    }

    /// Sends new events to the clients that follow them, as fast as these read.
    pub(crate) fn send_events(&mut self, journal: &Journal) {
        self.clients.retain_mut(|client| {
            let found = client.take_events(journal);
            !found || client.write()
        });
    }

    /// Answers `down`; the connection closes when the network is down.
    pub(crate) fn answer_down(&mut self, request: &ClientRequest) {
        self.answer(request, rpc::result(&Stopping { stopping: true }), 0);
    }

    /// Answers a command that has ended.
    pub(crate) fn answer_command(&mut self, request: &ClientRequest, result: &CommandResult) {
        self.answer(request, rpc::result(result), 1);
    }

    /// Refuses a command.
    pub(crate) fn answer_refused(&mut self, request: &ClientRequest, reason: &str) {
        let error = Error::new(Error::INVALID_PARAMS, reason);
        self.answer(request, Err(error), 1);
    }

    /// Sends an answer; `awaited` is 1 for a request that took its time.
    fn answer(&mut self, request: &ClientRequest, result: Result<Value, Error>, awaited: u32) {
        let found = self.clients.iter_mut().find(|c| c.number == request.client);
        let Some(client) = found else { return };
        client.awaits = client.awaits.saturating_sub(awaited);
        if let Some(id) = &request.id {
            client.output.push(&rpc::answer(id, result));
        }
        if !client.write() {
            self.clients.retain(|c| c.number != request.client);
        }
    }
}
