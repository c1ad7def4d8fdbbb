//! The supervisor's socket, `rcdeploy.sock` in the run directory.
//!
//! It decodes requests and sends answers and events; the supervisor decides what the answers are. A
//! client that reads events too slowly loses some, and gets their number.

use crate::log::journal::Journal;
use rc_management::rpc::{self, Error};
use rc_management::server::{Received, ServedClient};
use rc_management::supervisor::{
    CommandResult, KeptEvents, NetworkStatus, Notification, Request, Stopping,
};
use rc_management::{Server, ServerSource};
use rustix::event::PollFlags;
use serde_json::Value;
use std::io;
use std::os::fd::BorrowedFd;
use std::path::Path;
use std::time::Instant;

/// How many bytes of events may wait for a client; later events wait in the journal.
const MAX_EVENT_OUTPUT: usize = 64 << 10;

/// The number of the next event for a client, if it follows events.
type NextEvent = Option<u64>;

/// The listening socket and its clients.
#[derive(Debug)]
pub(crate) struct Control(Server<NextEvent>);

/// A request of a client.
#[derive(Debug)]
pub(crate) struct ClientRequest {
    client: u64,
    id: Option<Value>,
    pub(crate) request: Request,
}

#[cfg(test)]
impl ClientRequest {
    /// A request of a client that is not connected.
    pub(super) fn of(client: u64, request: Request) -> Self {
        Self {
            client,
            id: None,
            request,
        }
    }

    pub(super) fn client(&self) -> u64 {
        self.client
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
        Server::bind(path).map(Self)
    }

    /// The descriptors to wait for.
    pub(crate) fn descriptors(
        &self,
    ) -> impl Iterator<Item = (ServerSource, BorrowedFd<'_>, PollFlags)> {
        self.0.descriptors()
    }

    /// When the passing of time next matters.
    pub(crate) fn deadline(&self) -> Option<Instant> {
        self.0.deadline()
    }

    /// Handles the passing of time.
    pub(crate) fn check(&mut self, now: Instant) {
        self.0.check(now);
    }

    /// Accepts, reads and writes.
    pub(crate) fn turn(&mut self, source: ServerSource, events: PollFlags) {
        self.0.turn(source, events);
    }

    /// Takes at most one request of each client, those first that control the network.
    pub(crate) fn requests(&mut self) -> Vec<ClientRequest> {
        let received = self.0.requests().into_iter();
        let mut requests: Vec<_> = received
            .filter_map(|received| self.decode(received))
            .collect();
        requests.sort_by_key(|r| matches!(r.request, Request::Status | Request::Events));
        requests
    }

    fn decode(&mut self, received: Received) -> Option<ClientRequest> {
        let Received { client, call } = received;
        let (id, request) = match call {
            Ok(call) => (call.id.clone(), Request::decode(call)),
            Err(error) => (Some(Value::Null), Err(error)),
        };
        match (request, id) {
            (Ok(request), id) => {
                // The end of the network, and the next event, are answers that take their time.
                if request != Request::Status {
                    self.0.defer(client);
                }
                Some(ClientRequest {
                    client,
                    id,
                    request,
                })
            }
            (Err(error), Some(id)) => {
                self.0.answer(client, &id, Err(error));
                None
            }
            (Err(_), None) => None,
        }
    }

    /// Answers `status`.
    pub(crate) fn answer_status(&mut self, request: &ClientRequest, status: &NetworkStatus) {
        self.answer(request, rpc::result(status));
    }

    /// Answers `events`; the events follow with [`Self::send_events`].
    pub(crate) fn answer_events(&mut self, request: &ClientRequest, journal: &Journal) {
        let (kept, first) = journal.kept();
        self.answer(request, rpc::result(&KeptEvents { kept }));
        if let Some(client) = self.0.client_mut(request.client) {
            client.state = Some(first);
            client.follows = true;
        }
    }

    /// Sends new events to the clients that follow them, as fast as these read.
    pub(crate) fn send_events(&mut self, journal: &Journal) {
        self.0
            .clients_mut()
            .for_each(|client| take_events(client, journal));
        self.0.flush();
    }

    /// Answers `down`; the connection closes when the network is down.
    pub(crate) fn answer_down(&mut self, request: &ClientRequest) {
        self.answer(request, rpc::result(&Stopping { stopping: true }));
    }

    /// Answers a command that has ended.
    pub(crate) fn answer_command(&mut self, request: &ClientRequest, result: &CommandResult) {
        self.0.settle(request.client);
        self.answer(request, rpc::result(result));
    }

    /// Refuses a command.
    pub(crate) fn answer_refused(&mut self, request: &ClientRequest, reason: &str) {
        self.0.settle(request.client);
        self.answer(request, Err(Error::new(Error::INVALID_PARAMS, reason)));
    }

    fn answer(&mut self, request: &ClientRequest, result: Result<Value, Error>) {
        if let Some(id) = &request.id {
            self.0.answer(request.client, id, result);
        }
    }
}

/// Queues the new events for a client that follows them.
fn take_events(client: &mut ServedClient<NextEvent>, journal: &Journal) {
    let Some(mut next) = client.state else {
        return;
    };
    while client.waiting() < MAX_EVENT_OUTPUT
        && let Some(event) = journal.get(next)
    {
        let (notification, count) = match event {
            Ok(event) => (Notification::Event(event.clone()), 1),
            Err(missed) => (Notification::Missed { events: missed }, missed),
        };
        client.push(&rpc::notification(&notification));
        next += count;
    }
    client.state = Some(next);
}
