//! The supervisor's socket, `rcdeploy.sock` in the run directory.
//!
//! It decodes requests and sends answers and events; the supervisor decides on the answers. A
//! client that reads events too slowly loses some, and gets their number.

use crate::log::journal::Journal;
use rc_management::chains::Chains;
use rc_management::rpc::{self, Error};
use rc_management::server::{Received, ServedClient};
use rc_management::supervisor::{
    CommandResult, KeptEvents, NetworkStatus, Notification, ParametersChanged, Request, Stopping,
};
use rc_management::{Listener, Server, ServerSource};
use rustix::event::PollFlags;
use serde_json::Value;
use std::io;
use std::os::fd::BorrowedFd;
use std::path::Path;
use std::time::Instant;

/// How many bytes of events may wait for a client; later events wait in the journal.
const MAX_EVENT_OUTPUT: usize = 64 << 10;

/// The client that represents the supervisor itself.
const OWN: u64 = u64::MAX;

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

impl ClientRequest {
    /// A request of the supervisor itself, whose answer is not needed.
    pub(super) fn own(request: Request) -> Self {
        Self {
            client: OWN,
            id: None,
            request,
        }
    }

    /// Whether it is a request of the supervisor itself.
    pub(super) fn is_own(&self) -> bool {
        self.client == OWN
    }
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
    /// Listens at `path`, where it replaces the socket of a supervisor that was killed, and at the
    /// abstract socket of the network. The caller owns the path.
    pub(crate) fn listen(path: &Path, by_name: Option<Listener>) -> io::Result<Self> {
        match std::fs::remove_file(path) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
            _ => {}
        }
        let mut server = Server::bind(path)?;
        if let Some(listener) = by_name {
            server.add(listener);
        }
        Ok(Self(server))
    }

    /// Serves clients of another listener, too.
    pub(crate) fn add(&mut self, listener: Listener) {
        self.0.add(listener);
    }

    /// Listens at its path again if the socket there was removed. Returns whether it was.
    pub(crate) fn restore(&mut self) -> io::Result<bool> {
        self.0.restore()
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
        requests.sort_by_key(|r| {
            matches!(
                r.request,
                Request::Status | Request::Events | Request::Chains { .. }
            )
        });
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
                if !matches!(request, Request::Status | Request::Chains { .. }) {
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

    /// Answers `chains`.
    pub(crate) fn answer_chains(&mut self, request: &ClientRequest, chains: &Chains) {
        self.answer(request, rpc::result(chains));
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

    /// Answers a change of parameters.
    pub(crate) fn answer_changed(&mut self, request: &ClientRequest, changed: &ParametersChanged) {
        self.0.settle(request.client);
        self.answer(request, rpc::result(changed));
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

#[cfg(test)]
mod tests {
    use super::*;
    use rc_management::event::{Event, Severity};
    use rustix::event::{PollFd, Timespec, poll};
    use std::io::{BufRead, BufReader, Write};
    use std::os::unix::net::UnixStream;
    use std::time::Duration;

    struct Client(BufReader<UnixStream>);

    impl Client {
        fn connect(path: &Path) -> Self {
            let stream = UnixStream::connect(path).expect("its socket");
            let limit = Some(Duration::from_mins(1));
            stream.set_read_timeout(limit).expect("a limit");
            Self(BufReader::new(stream))
        }

        fn ask(&self, id: u64, method: &str) {
            let line = format!(r#"{{"jsonrpc":"2.0","id":{id},"method":"{method}"}}"#) + "\n";
            self.0.get_ref().write_all(line.as_bytes()).expect("room");
        }

        fn has_answer(&self) -> bool {
            let now = Timespec::try_from(Duration::ZERO).expect("a short time");
            let mut fd = [PollFd::new(self.0.get_ref(), PollFlags::IN)];
            poll(&mut fd, Some(&now)).expect("it can be waited for") > 0
        }

        fn line(&mut self) -> Value {
            let mut line = String::new();
            self.0.read_line(&mut line).expect("an answer");
            serde_json::from_str(&line).expect("JSON")
        }
    }

    /// Serves until so many requests have come, in turns that take all that has come.
    fn requests(control: &mut Control, count: usize) -> Vec<ClientRequest> {
        let limit = Instant::now() + Duration::from_mins(1);
        let mut requests = Vec::new();
        while requests.len() < count {
            assert!(Instant::now() < limit, "no request comes");
            turn(control);
            requests.extend(control.requests());
        }
        requests
    }

    fn turn(control: &mut Control) {
        let short = Timespec::try_from(Duration::from_millis(10)).expect("a short time");
        let all: Vec<_> = control.descriptors().collect();
        let fds = all
            .iter()
            .map(|(_, fd, flags)| PollFd::from_borrowed_fd(*fd, *flags));
        let mut fds: Vec<PollFd<'_>> = fds.collect();
        poll(&mut fds, Some(&short)).expect("it can be waited for");
        let ready: Vec<_> = fds
            .iter()
            .zip(&all)
            .filter(|(fd, _)| !fd.revents().is_empty())
            .map(|(fd, (source, ..))| (*source, fd.revents()))
            .collect();
        for (source, events) in ready {
            control.turn(source, events);
        }
        control.check(Instant::now());
    }

    #[test]
    fn the_socket_of_a_killed_supervisor_is_replaced() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.sock");
        drop(Control::listen(&path, None).expect("a socket"));
        let mut control = Control::listen(&path, None).expect("a socket");
        let client = Client::connect(&path);
        client.ask(1, "status");
        assert_eq!(requests(&mut control, 1)[0].request, Request::Status);
        // A folder is not its socket.
        assert!(Control::listen(folder.path(), None).is_err());
    }

    #[test]
    fn requests_that_control_come_first_and_each_gets_its_answer() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.sock");
        let mut control = Control::listen(&path, None).expect("a socket");
        let mut asks = Client::connect(&path);
        let mut ends = Client::connect(&path);
        // Until both are served.
        for client in [&mut asks, &mut ends] {
            client.ask(0, "dance");
            while !client.has_answer() {
                turn(&mut control);
                assert!(control.requests().is_empty(), "there is no such request");
            }
            assert_eq!(client.line()["error"]["code"], -32601);
        }
        asks.ask(1, "status");
        ends.ask(2, "down");
        // A local socket delivers at once, so one turn reads both.
        let both = requests(&mut control, 2);
        assert_eq!(both[0].request, Request::Down);
        control.answer_down(&both[0]);
        let status = NetworkStatus {
            network: "net".to_owned(),
            pid: 7,
            guard: None,
            directory: folder.path().to_owned(),
            troubles: Vec::new(),
            ddsl: "net.ddsl".into(),
            digest: None,
            changed: false,
            components: Vec::new(),
        };
        control.answer_status(&both[1], &status);
        assert_eq!(ends.line()["result"]["stopping"], true);
        assert_eq!(asks.line()["result"]["network"], "net");
        asks.ask(3, "ring");
        let request = requests(&mut control, 1).remove(0);
        control.answer_refused(&request, "no ring");
        assert_eq!(asks.line()["error"]["message"], "no ring");
        asks.ask(4, "ring");
        let request = requests(&mut control, 1).remove(0);
        let done = CommandResult {
            done: vec!["a".to_owned()],
            failed: Vec::new(),
        };
        control.answer_command(&request, &done);
        let answer = asks.line();
        assert_eq!(
            (&answer["id"], &answer["result"]["done"][0]),
            (&4.into(), &"a".into())
        );
    }

    #[test]
    fn a_client_has_a_limit_to_read_its_answer() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.sock");
        let mut control = Control::listen(&path, None).expect("a socket");
        let client = Client::connect(&path);
        client.ask(1, "ring");
        let request = requests(&mut control, 1).remove(0);
        assert_eq!(control.deadline(), None);
        control.answer_refused(&request, &"x".repeat(1 << 20));
        let deadline = control.deadline().expect("a time");
        assert!(deadline > Instant::now());
        control.check(Instant::now());
        assert_eq!(control.0.clients_mut().count(), 1, "it has time until then");
    }

    #[test]
    fn a_slow_follower_gets_the_events_that_are_kept_and_the_number_of_the_others() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.sock");
        let mut control = Control::listen(&path, None).expect("a socket");
        let mut client = Client::connect(&path);
        let mut journal = Journal::default();
        let mut count = 0;
        let mut add = |journal: &mut Journal, events: u64| {
            for _ in 0..events {
                let text = format!("{count} {}", "x".repeat(1000));
                journal.add(&Event::network(Severity::Info, "up", text));
                count += 1;
            }
        };
        add(&mut journal, 3);
        client.ask(1, "events");
        let request = requests(&mut control, 1).remove(0);
        assert_eq!(request.request, Request::Events);
        control.answer_events(&request, &journal);
        assert_eq!(client.line()["result"]["kept"], 3);
        let mut next = 0;
        let mut missed = 0;
        // It does not read while twice as many events come as are kept.
        for _ in 0..20 {
            add(&mut journal, 100);
            control.send_events(&journal);
            let server = &mut control.0;
            let waits = server.clients_mut().map(|client| client.waiting()).max();
            assert!(waits < Some(MAX_EVENT_OUTPUT + 2000), "{waits:?}");
        }
        while next < 2003 {
            control.send_events(&journal);
            let line = client.line();
            match line["method"].as_str() {
                Some("missed") => {
                    let events = line["params"]["events"].as_u64().expect("a number");
                    missed += events;
                    next += events;
                }
                Some("event") => {
                    let text = line["params"]["message"].as_str().expect("a text");
                    let number = text.split(' ').next().and_then(|text| text.parse().ok());
                    assert_eq!(number, Some(next));
                    next += 1;
                }
                other => panic!("{other:?}"),
            }
        }
        assert!(missed > 0 && missed < 1003, "{missed}");
    }
}
