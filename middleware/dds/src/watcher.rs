//! The thread of discovery. It asks the library about what the library announces; the library's own
//! threads must not.

use crate::endpoint_state::{Peer, ReaderState, Watched, WriterState, matched};
use crate::{names, qos};
use rc_ddsc::{Discovery, End, Event, Guid, Listener};
use rc_network::{EndpointInfo, EndpointKind, Mismatches, Role, differences, lock};
use std::collections::HashMap;
use std::sync::mpsc::{Receiver, Sender};
use std::sync::{Arc, Mutex, Weak};

/// What discovery knows of the domain.
pub(crate) struct Discovered {
    readers: Mutex<HashMap<Guid, End>>,
    writers: Mutex<HashMap<Guid, End>>,
    /// The readers of this component that receive requests.
    servers: Mutex<Vec<Weak<dyn Watched>>>,
    pub(crate) mismatches: Mismatches,
}

impl Discovered {
    pub(crate) fn new(host: &str) -> Self {
        Self {
            readers: Mutex::default(),
            writers: Mutex::default(),
            servers: Mutex::default(),
            mismatches: Mismatches::new(host),
        }
    }

    fn endpoints(&self, kind: EndpointKind) -> &Mutex<HashMap<Guid, End>> {
        match kind {
            EndpointKind::Writer => &self.writers,
            EndpointKind::Reader => &self.readers,
        }
    }

    /// What the endpoints at `topic` that are not of the participant `own` tell of themselves.
    pub(crate) fn endpoints_at(&self, topic: &str, own: Guid) -> Vec<EndpointInfo> {
        let mut infos = Vec::new();
        for endpoints in [&self.readers, &self.writers] {
            let endpoints = lock(endpoints);
            let there = endpoints
                .values()
                .filter(|end| end.topic == topic && end.participant != own);
            infos.extend(there.filter_map(|end| EndpointInfo::parse(&end.user_data)));
        }
        infos
    }

    /// Adds a reader that receives requests.
    pub(crate) fn add_server(&self, server: &Arc<dyn Watched>) {
        let mut servers = lock(&self.servers);
        servers.retain(|server| server.strong_count() > 0);
        servers.push(Arc::downgrade(server));
    }
}

/// What the library announces, in the order in which it happened.
pub(crate) enum Message {
    /// An endpoint of this kind was discovered, or has changed or gone.
    Discovered(EndpointKind),
    /// Something happened to an endpoint of this component.
    Event(Arc<dyn Watched>, Event),
    /// The component ends.
    End,
}

/// Hands discovery on to the thread of discovery.
pub(crate) struct ForwardDiscovery(pub(crate) EndpointKind, pub(crate) Sender<Message>);

impl Listener for ForwardDiscovery {
    fn event(&self, _event: Event) {
        let _ = self.1.send(Message::Discovered(self.0));
    }
}

/// Hands the events of an endpoint on to the thread of discovery, and receives samples.
pub(crate) struct Forward {
    endpoint: Arc<dyn Watched>,
    reader: Option<Arc<ReaderState>>,
    messages: Sender<Message>,
}

impl Forward {
    pub(crate) fn of_writer(writer: &Arc<WriterState>, messages: Sender<Message>) -> Self {
        Self {
            endpoint: Arc::clone(writer) as _,
            reader: None,
            messages,
        }
    }

    pub(crate) fn of_reader(reader: &Arc<ReaderState>, messages: Sender<Message>) -> Self {
        Self {
            endpoint: Arc::clone(reader) as _,
            reader: Some(Arc::clone(reader)),
            messages,
        }
    }
}

impl Listener for Forward {
    fn event(&self, event: Event) {
        match (&self.reader, event) {
            (Some(reader), Event::Data) => reader.receive(),
            (None, Event::Data) => {}
            _ => {
                let endpoint = Arc::clone(&self.endpoint);
                let _ = self.messages.send(Message::Event(endpoint, event));
            }
        }
    }
}

/// The thread.
pub(crate) struct Watcher {
    pub(crate) host: String,
    pub(crate) discovered: Arc<Discovered>,
    /// Of readers and of writers.
    pub(crate) discoveries: Arc<[Discovery; 2]>,
}

impl Watcher {
    pub(crate) fn run(&self, messages: &Receiver<Message>) {
        while let Ok(message) = messages.recv() {
            match message {
                Message::Discovered(kind) => self.discover(kind),
                Message::Event(endpoint, event) => self.handle(&*endpoint, event),
                Message::End => return,
            }
        }
    }

    fn discover(&self, kind: EndpointKind) {
        let [readers, writers] = &*self.discoveries;
        let discovery = match kind {
            EndpointKind::Reader => readers,
            EndpointKind::Writer => writers,
        };
        let mut endpoints = lock(self.discovered.endpoints(kind));
        // What cannot be read now is read at the next announcement.
        let _ = discovery.take(|end, guid| match end {
            Some(end) => {
                self.compare_servers(&end);
                endpoints.insert(guid, end);
            }
            None => {
                endpoints.remove(&guid);
            }
        });
    }

    /// Reports a process on another machine that serves an address of this component.
    fn compare_servers(&self, end: &End) {
        let info = EndpointInfo::parse(&end.user_data);
        let rival = info.filter(|info| info.role == Role::Server && info.host != self.host);
        let Some(rival) = rival else { return };
        for server in lock(&self.discovered.servers)
            .iter()
            .filter_map(Weak::upgrade)
        {
            let state = server.state();
            if state.topic() == end.topic && state.should_report(&end.guid) {
                let address = names::address_of_requests(state.topic());
                self.discovered.mismatches.second_server(address, &rival);
            }
        }
    }

    fn handle(&self, endpoint: &dyn Watched, event: Event) {
        let state = endpoint.state();
        let topic = state.topic();
        match event {
            Event::Data => {}
            Event::Matched(handle) => {
                if let Some(peer) = matched(endpoint, handle) {
                    self.report_types(endpoint, &peer);
                }
            }
            Event::Unmatched(handle) => state.remove(&handle),
            Event::Incompatible(_) => self.report_qos(endpoint),
            Event::Deadline(count) => {
                let limit = state.identity.contract.deadline;
                if let (Some(suppressed), Some(limit)) = (state.report_limit.allow(), limit) {
                    let count = u64::from(count) + suppressed;
                    tracing::warn!(
                        "no sample on `{topic}` within its deadline of {limit:?} ({count} times)"
                    );
                }
            }
            Event::Alive(_, true) => tracing::info!("a publisher of `{topic}` is back"),
            Event::Alive(_, false) => tracing::warn!(
                "a publisher of `{topic}` has been silent for longer than its liveliness"
            ),
        }
    }

    fn report_types(&self, endpoint: &dyn Watched, peer: &Peer) {
        if let Some(info) = &peer.info
            && endpoint.state().should_report(&peer.guid)
        {
            let identity = &endpoint.state().identity;
            self.discovered.mismatches.types_differ(identity, info);
        }
    }

    /// Reports the endpoints whose quality of service does not match: the library does not say
    /// which it means.
    fn report_qos(&self, endpoint: &dyn Watched) {
        let state = endpoint.state();
        let kind = state.identity.kind.opposite();
        self.discover(kind);
        let endpoints = lock(self.discovered.endpoints(kind));
        for end in endpoints.values().filter(|end| end.topic == state.topic()) {
            let (ours, theirs) = (&state.identity.contract, qos::contract_of(end));
            let differences = match state.identity.kind {
                EndpointKind::Writer => differences(ours, &theirs),
                EndpointKind::Reader => differences(&theirs, ours),
            };
            if differences.is_empty() || !state.should_report(&end.guid) {
                continue;
            }
            let info = EndpointInfo::parse(&end.user_data);
            let (identity, differences) = (&state.identity, differences.join("; "));
            let mismatches = &self.discovered.mismatches;
            mismatches.qos_differs(identity, info.as_ref(), &end.guid, &differences);
        }
    }
}
