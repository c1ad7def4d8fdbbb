//! The thread of discovery. It queries the library about its announcements, which the library's own
//! threads must not do.

use crate::entities::{ReaderState, WatchedEndpoint, WriterState, matched};
use crate::{EndpointInfo, EndpointKind, Guid, Identity, Mismatches, Peer, RateLimit, Role, lock};
use rc_ddsc::{Discovery, End, Event, Listener};
use rc_diagnostics::foreign::clean;
use rc_middleware::qos::Difference;
use std::collections::HashMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender};
use std::sync::{Arc, Mutex, Weak};

/// Most bytes of the endpoints of one kind that are remembered; strangers choose their texts.
const MOST_BYTES: usize = 16 << 20;
/// Upper bound of an endpoint's memory in addition to its texts, in bytes.
const OVERHEAD: usize = 512;

/// The endpoints of one kind that are discovered, as many as have room.
#[derive(Default)]
struct Ends {
    ends: HashMap<Guid, End>,
    bytes: usize,
}

impl Ends {
    /// Adds an endpoint, or its changes. One without room is not compared with later endpoints of
    /// this component, which only costs reports about mismatches.
    fn insert(&mut self, guid: Guid, end: End) {
        static RATE_LIMIT: RateLimit = RateLimit::new();
        self.remove(&guid);
        let bytes = size(&end);
        if self.bytes + bytes <= MOST_BYTES {
            self.bytes += bytes;
            self.ends.insert(guid, end);
        } else if RATE_LIMIT.allow().is_some() {
            let count = self.ends.len();
            tracing::warn!(
                "the domain has too many endpoints: after {count}, with {MOST_BYTES} bytes, no more are remembered"
            );
        }
    }

    fn remove(&mut self, guid: &Guid) {
        if let Some(end) = self.ends.remove(guid) {
            self.bytes -= size(&end);
        }
    }

    fn values(&self) -> impl Iterator<Item = &End> {
        self.ends.values()
    }
}

fn size(end: &End) -> usize {
    OVERHEAD + end.topic.len() + end.type_name.len() + end.user_data.len()
}

/// Endpoints that discovery has found in the domain.
pub(crate) struct Discovered {
    /// This machine.
    host: String,
    readers: Mutex<Ends>,
    writers: Mutex<Ends>,
    /// The endpoints of this component, each with the name of its type.
    own: Mutex<Vec<(Weak<dyn WatchedEndpoint>, String)>>,
    pub(crate) mismatches: Mismatches,
    /// Whether a message reports new readers, or writers, and was not taken yet.
    announced: [AtomicBool; 2],
    /// Gives the name of a service, for the topic of its requests.
    service: fn(&str) -> &str,
}

impl Discovered {
    pub(crate) fn new(host: &str, service: fn(&str) -> &str) -> Self {
        Self {
            host: host.to_owned(),
            readers: Mutex::default(),
            writers: Mutex::default(),
            own: Mutex::default(),
            mismatches: Mismatches::new(host),
            announced: Default::default(),
            service,
        }
    }

    fn announced(&self, kind: EndpointKind) -> &AtomicBool {
        match kind {
            EndpointKind::Reader => &self.announced[0],
            EndpointKind::Writer => &self.announced[1],
        }
    }

    fn endpoints(&self, kind: EndpointKind) -> &Mutex<Ends> {
        match kind {
            EndpointKind::Writer => &self.writers,
            EndpointKind::Reader => &self.readers,
        }
    }

    /// The announcements of the endpoints at `topic` that are not of the participant `own`.
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

    /// Adds an endpoint of this component, whose participant is `own`.
    pub(crate) fn watch(&self, endpoint: &Arc<dyn WatchedEndpoint>, type_name: &str, own: Guid) {
        let mut all = lock(&self.own);
        all.retain(|(endpoint, _)| endpoint.strong_count() > 0);
        all.push((Arc::downgrade(endpoint), type_name.to_owned()));
        drop(all);
        let kind = endpoint.state().identity.kind;
        for kind in [kind, kind.opposite()] {
            for end in lock(self.endpoints(kind)).values() {
                if end.participant != own {
                    self.compare(&**endpoint, type_name, end, kind);
                }
            }
        }
    }

    /// Reports an endpoint of this kind whose type has another name, and a process on another
    /// machine that serves the address of this one, too.
    fn compare(
        &self,
        endpoint: &dyn WatchedEndpoint,
        type_name: &str,
        end: &End,
        kind: EndpointKind,
    ) {
        self.compare_type_names(endpoint, type_name, end, kind);
        let Identity {
            info, kind, topic, ..
        } = &endpoint.state().identity;
        let serves = (info.role, *kind) == (Role::Server, EndpointKind::Reader);
        if !serves || *topic != end.topic {
            return;
        }
        let rival = EndpointInfo::parse(&end.user_data);
        if let Some(rival) = rival.filter(|one| one.role == Role::Server && one.host != self.host)
            && endpoint.state().should_report(&end.guid)
        {
            let service = (self.service)(topic);
            self.mismatches
                .second_server(topic, &end.guid, service, &rival);
        }
    }

    /// The reports about endpoints that do not match those of this component and are there.
    pub(crate) fn mismatches(&self) -> Vec<String> {
        let own = lock(&self.own);
        let open: Vec<_> = own.iter().filter_map(|(own, _)| own.upgrade()).collect();
        drop(own);
        self.mismatches
            .list(|topic| open.iter().any(|own| own.state().topic() == topic))
    }

    /// Reports an endpoint that the library does not match because its type has another name.
    fn compare_type_names(
        &self,
        endpoint: &dyn WatchedEndpoint,
        type_name: &str,
        end: &End,
        kind: EndpointKind,
    ) {
        let Identity {
            topic, kind: own, ..
        } = &endpoint.state().identity;
        if own.opposite() != kind
            || *topic != end.topic
            || type_name == end.type_name
            || !endpoint.state().should_report(&end.guid)
        {
            return;
        }
        let (theirs, who) = (clean(&end.type_name), crate::hex(&end.guid));
        self.mismatches.error(&end.guid, topic, format!(
            "`{topic}` is {type_name} here and {theirs} to the endpoint {who}; the two exchange nothing"
        ));
    }
}

/// Event of the library, in the order of occurrence.
pub(crate) enum Message {
    /// An endpoint of this kind was discovered, has changed, or has left.
    Discovered(EndpointKind),
    /// Events of an endpoint of this component wait.
    Events(Arc<dyn WatchedEndpoint>, Arc<Mutex<WaitingEvents>>),
    /// The component ends.
    End,
}

/// The events of one endpoint that the thread of discovery has not seen. Strangers cause as many as
/// they like, so only what counts in the end is kept: at most one for each peer that is there, or
/// that the thread knows.
#[derive(Debug, Default)]
pub(crate) struct WaitingEvents {
    /// Whether a peer was matched or unmatched last.
    peers: HashMap<u64, bool>,
    incompatible: Option<Event>,
    deadlines: u32,
    alive: Option<Event>,
    /// Whether a message reports them.
    is_told: bool,
}

impl WaitingEvents {
    /// Adds an event. Returns whether a message has to tell.
    fn add(&mut self, event: Event) -> bool {
        match event {
            Event::Data => return false,
            Event::Matched(handle) => drop(self.peers.insert(handle, true)),
            // The thread has not seen a peer whose arrival waits.
            Event::Unmatched(handle) if self.peers.get(&handle) == Some(&true) => {
                self.peers.remove(&handle);
            }
            Event::Unmatched(handle) => drop(self.peers.insert(handle, false)),
            Event::Incompatible(_) => self.incompatible = Some(event),
            Event::Deadline(count) => self.deadlines = self.deadlines.saturating_add(count),
            Event::Alive(..) => self.alive = Some(event),
        }
        !std::mem::replace(&mut self.is_told, true)
    }

    /// Takes the events. A further message reports later events.
    fn take(&mut self) -> Vec<Event> {
        let Self {
            peers,
            incompatible,
            deadlines,
            alive,
            is_told: _,
        } = std::mem::take(self);
        let peers = peers.into_iter().map(|(handle, is_there)| {
            if is_there {
                Event::Matched(handle)
            } else {
                Event::Unmatched(handle)
            }
        });
        let deadline = (deadlines > 0).then_some(Event::Deadline(deadlines));
        let others = incompatible.into_iter().chain(deadline).chain(alive);
        peers.chain(others).collect()
    }
}

/// Hands discovery on to the thread of discovery.
pub(crate) struct ForwardDiscovery {
    pub(crate) kind: EndpointKind,
    pub(crate) discovered: Arc<Discovered>,
    pub(crate) messages: Sender<Message>,
}

impl Listener for ForwardDiscovery {
    fn event(&self, _event: Event) {
        // Other programs may announce at any rate. One message reports everything new.
        let announced = self.discovered.announced(self.kind);
        if !announced.swap(true, Ordering::AcqRel) {
            let _ = self.messages.send(Message::Discovered(self.kind));
        }
    }
}

/// Hands the events of an endpoint on to the thread of discovery, and receives samples.
pub(crate) struct Forward {
    endpoint: Arc<dyn WatchedEndpoint>,
    reader: Option<Arc<ReaderState>>,
    waiting: Arc<Mutex<WaitingEvents>>,
    messages: Sender<Message>,
}

impl Forward {
    pub(crate) fn of_writer(writer: &Arc<WriterState>, messages: Sender<Message>) -> Self {
        Self {
            endpoint: Arc::clone(writer) as _,
            reader: None,
            waiting: Arc::default(),
            messages,
        }
    }

    pub(crate) fn of_reader(reader: &Arc<ReaderState>, messages: Sender<Message>) -> Self {
        Self {
            endpoint: Arc::clone(reader) as _,
            reader: Some(Arc::clone(reader)),
            waiting: Arc::default(),
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
                if lock(&self.waiting).add(event) {
                    let endpoint = Arc::clone(&self.endpoint);
                    let waiting = Arc::clone(&self.waiting);
                    let _ = self.messages.send(Message::Events(endpoint, waiting));
                }
            }
        }
    }
}

/// The thread.
pub(crate) struct Watcher {
    pub(crate) discovered: Arc<Discovered>,
    /// For readers and for writers.
    pub(crate) discoveries: Arc<[Discovery; 2]>,
}

impl Watcher {
    pub(crate) fn run(&self, messages: &Receiver<Message>) {
        while let Ok(message) = messages.recv() {
            match message {
                Message::Discovered(kind) => {
                    // A further message reports events during the look.
                    let announced = self.discovered.announced(kind);
                    announced.store(false, Ordering::Release);
                    self.discover(kind);
                }
                Message::Events(endpoint, waiting) => {
                    let events = lock(&waiting).take();
                    for event in events {
                        self.handle(&*endpoint, event);
                    }
                }
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
        // Endpoints that cannot be read now are read at the next announcement.
        let _ = discovery.take(|end, guid| {
            if let Some(end) = end {
                self.compare(&end, kind);
                endpoints.insert(guid, end);
            } else {
                endpoints.remove(&guid);
                self.discovered.mismatches.forget(&guid);
            }
        });
    }

    /// Compares an endpoint with those of this component at its topic.
    fn compare(&self, end: &End, kind: EndpointKind) {
        let own: Vec<_> = {
            let own = lock(&self.discovered.own);
            let there = own.iter();
            there
                .filter_map(|(own, type_name)| Some((own.upgrade()?, type_name)))
                .filter(|(own, _)| own.state().topic() == end.topic)
                .map(|(own, type_name)| (own, type_name.clone()))
                .collect()
        };
        for (own, type_name) in own {
            self.discovered.compare(&*own, &type_name, end, kind);
        }
    }

    fn handle(&self, endpoint: &dyn WatchedEndpoint, event: Event) {
        let state = endpoint.state();
        let topic = state.topic();
        match event {
            Event::Data => {}
            Event::Matched(handle) => {
                if let Some(peer) = matched(endpoint, handle) {
                    self.report_types(endpoint, &peer);
                }
            }
            Event::Unmatched(handle) => state.remove(handle),
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

    fn report_types(&self, endpoint: &dyn WatchedEndpoint, peer: &Peer) {
        if let Some(info) = &peer.info
            && endpoint.state().should_report(&peer.guid)
        {
            let identity = &endpoint.state().identity;
            let mismatches = &self.discovered.mismatches;
            mismatches.types_differ(identity, &peer.guid, info);
        }
    }

    /// Reports the endpoints whose quality of service does not match: the library does not say
    /// which it means.
    fn report_qos(&self, endpoint: &dyn WatchedEndpoint) {
        let state = endpoint.state();
        let kind = state.identity.kind.opposite();
        self.discover(kind);
        let endpoints = lock(self.discovered.endpoints(kind));
        for end in endpoints.values().filter(|end| end.topic == state.topic()) {
            let (ours, theirs) = (&state.identity.contract, &end.contract);
            let differences = match state.identity.kind {
                EndpointKind::Writer => ours.differences(theirs),
                EndpointKind::Reader => theirs.differences(ours),
            };
            if differences.is_empty() || !state.should_report(&end.guid) {
                continue;
            }
            let info = EndpointInfo::parse(&end.user_data);
            let (identity, differences) = (
                &state.identity,
                differences
                    .iter()
                    .map(Difference::to_string)
                    .collect::<Vec<_>>()
                    .join("; "),
            );
            let mismatches = &self.discovered.mismatches;
            mismatches.qos_differs(identity, info.as_ref(), &end.guid, &differences);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::EndpointState;
    use rc_middleware::qos::{Contract, Qos};
    use rc_middleware::{TypeIdentity, WakeEvent};
    use std::sync::mpsc::channel;

    #[test]
    fn many_announcements_wait_as_one_message() {
        let discovered = Arc::new(Discovered::new("here", |topic| topic));
        let (messages, received) = channel();
        let forward = |kind| ForwardDiscovery {
            kind,
            discovered: Arc::clone(&discovered),
            messages: messages.clone(),
        };
        let [readers, writers] = [EndpointKind::Reader, EndpointKind::Writer].map(forward);
        for _ in 0..1000 {
            readers.event(Event::Data);
            writers.event(Event::Data);
        }
        assert_eq!(received.try_iter().count(), 2);
        let announced = discovered.announced(EndpointKind::Reader);
        announced.store(false, Ordering::Release);
        readers.event(Event::Data);
        writers.event(Event::Data);
        let waiting: Vec<Message> = received.try_iter().collect();
        assert!(matches!(
            waiting.as_slice(),
            [Message::Discovered(EndpointKind::Reader)]
        ));
    }

    /// The reader of requests of a server.
    struct ServerReader(EndpointState);

    impl WatchedEndpoint for ServerReader {
        fn state(&self) -> &EndpointState {
            &self.0
        }

        fn look_up(&self, _handle: u64) -> Option<End> {
            None
        }
    }

    /// Between the check of a new server and its first comparison, discovery may find another one.
    #[test]
    fn a_server_that_was_found_before_is_reported_too() {
        let info = |host: &str| EndpointInfo {
            role: Role::Server,
            types: TypeIdentity {
                name: "T".to_owned(),
                hash: 7,
            },
            instance: "lidar".to_owned(),
            pid: 5,
            host: host.to_owned(),
        };
        let discovered = Discovered::new("here@1", |topic| topic);
        for (number, host) in [(1, "here@1"), (2, "there@2")] {
            let end = End {
                guid: [number; 16],
                participant: [number; 16],
                topic: "Laser".to_owned(),
                type_name: "T".to_owned(),
                contract: Contract::from(&Qos::CALL),
                lifespan: None,
                user_data: info(host).user_data("").into_bytes(),
            };
            lock(&discovered.readers).insert(end.guid, end);
        }
        let identity = Identity {
            topic: "Laser".to_owned(),
            kind: EndpointKind::Reader,
            info: info("here@1"),
            contract: Contract::from(&Qos::CALL),
        };
        let signal = WakeEvent::new().expect("a wake event");
        let state = EndpointState::new(identity, signal, Arc::new(()));
        let server: Arc<dyn WatchedEndpoint> = Arc::new(ServerReader(state));
        discovered.watch(&server, "T", [0; 16]);
        let told = discovered.mismatches();
        let wanted = "`Laser` has two servers, this one and pid 5 (lidar) on there; ";
        assert!(
            matches!(&told[..], [one] if one.starts_with(wanted)),
            "{told:?}"
        );
    }

    #[test]
    fn events_of_an_endpoint_wait_as_one_message_and_have_a_bound() {
        let mut waiting = WaitingEvents::default();
        assert!(waiting.add(Event::Matched(0)), "a message tells");
        assert!(waiting.add(Event::Unmatched(7)) == waiting.add(Event::Data));
        for handle in 1000..5000 {
            assert!(!waiting.add(Event::Matched(handle)));
            assert!(!waiting.add(Event::Alive(handle, true)));
            assert!(!waiting.add(Event::Deadline(1)));
            assert!(!waiting.add(Event::Unmatched(handle)));
        }
        let mut events = waiting.take();
        events.sort_by_key(|event| format!("{event:?}"));
        let expected = [
            Event::Alive(4999, true),
            Event::Deadline(4000),
            Event::Matched(0),
            Event::Unmatched(7),
        ];
        assert_eq!(format!("{events:?}"), format!("{expected:?}"));
        assert!(waiting.take().is_empty());
        // The thread knows this peer now, so its end is reported.
        assert!(waiting.add(Event::Unmatched(0)), "another message tells");
        assert_eq!(waiting.take().len(), 1);
    }

    #[test]
    fn remembered_endpoints_have_a_bound_in_bytes() {
        let end = |number: u32, length: usize| {
            let mut guid = [0; 16];
            guid[..4].copy_from_slice(&number.to_be_bytes());
            End {
                guid,
                participant: guid,
                topic: "t".repeat(length),
                type_name: String::new(),
                contract: Contract::from(&Qos::PUBLISHER),
                lifespan: None,
                user_data: Vec::new(),
            }
        };
        let mut ends = Ends::default();
        for number in 0..100 {
            let end = end(number, 1 << 20);
            ends.insert(end.guid, end);
        }
        assert_eq!(ends.values().count(), 15);
        assert!(ends.bytes <= MOST_BYTES);
        // A change replaces the known state.
        let changed = end(3, 10);
        ends.insert(changed.guid, changed.clone());
        assert_eq!(ends.ends[&changed.guid], changed);
        for number in 0..100 {
            ends.remove(&end(number, 0).guid);
        }
        assert_eq!((ends.values().count(), ends.bytes), (0, 0));
    }
}
