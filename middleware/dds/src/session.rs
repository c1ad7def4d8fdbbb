//! One component's part in a domain: the participant, what is known of the domain, and the thread that learns it.

use crate::config;
use crate::endpoint_state::{EndpointState, Entity, Inbox};
use crate::qos;
use crate::report;
use crate::udp;
use rc_ddsc::{Discovery, Domain, End, Event, Guid, Listener, Participant, Qos};
use rc_middleware::{Environment, OpenError, TypeIdentity, WakeEvent};
use rc_network::{EndpointInfo, LocalRegistry, Mismatches, Role, lock};
use std::cell::{Cell, RefCell};
use std::collections::HashMap;
use std::rc::Rc;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, Weak};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// How long a component waits, in all, for ends on this machine that it does not find over the network.
const PATIENCE: Duration = Duration::from_secs(3);
/// How long after its start a client that finds no server waits for one on another machine.
const GRACE: Duration = Duration::from_millis(300);
/// How often the notices of others are looked at while they are waited for.
const LOOK: Duration = Duration::from_millis(2);
/// The library's ids for a part of this process in a domain in which it has a part already.
const FURTHER_PARTS: std::ops::Range<u32> = 1000..10_000;

/// What the ends of one component share.
pub(crate) struct Session {
    pub(crate) environment: Environment,
    pub(crate) host: String,
    registry: LocalRegistry,
    known: Arc<Discovered>,
    patience: Cell<Duration>,
    start: Instant,
    messages: Sender<WatcherMessage>,
    watcher: Option<JoinHandle<()>>,
    /// The writers, for who lingers.
    writers: RefCell<Vec<Weak<Entity>>>,
    // In the order in which they go.
    _discoveries: Arc<[Discovery; 2]>,
    participant: Participant,
    _domain: Domain,
}

/// What is known of the domain.
#[derive(Default)]
struct Discovered {
    /// Readers, and writers.
    ends: [Mutex<HashMap<Guid, End>>; 2],
    /// The ends of this component on which it hears requests.
    serving: Mutex<Vec<Weak<EndpointState>>>,
    mismatches: Mismatches,
}

/// What the watcher is told, in the order in which it happened.
enum WatcherMessage {
    /// Something was discovered: a writer, or else a reader.
    Discovered(bool),
    /// Something happened to an end.
    Event(Arc<EndpointState>, Event),
    /// The component ends.
    End,
}

/// One end of a topic of DDS. It leaves the domain when it goes.
pub(crate) struct Port {
    pub(crate) entity: Arc<Entity>,
    pub(crate) state: Arc<EndpointState>,
    pub(crate) guid: Guid,
    pub(crate) session: Rc<Session>,
}

/// What an end is to be.
pub(crate) struct EndpointSpec<'a> {
    /// What people call it.
    pub(crate) address: &'a str,
    /// The name of the topic in DDS, and of its type.
    pub(crate) topic: String,
    pub(crate) type_name: String,
    pub(crate) role: Role,
    pub(crate) types: &'a TypeIdentity,
    pub(crate) sends: bool,
    pub(crate) qos: Qos<'static>,
    pub(crate) signal: WakeEvent,
    pub(crate) inbox: Arc<dyn Inbox>,
}

impl Session {
    pub(crate) fn open(environment: &Environment) -> Result<Self, OpenError> {
        rc_ddsc::set_log(report::library);
        let failed = |what: &str, error: &dyn std::fmt::Display| {
            config::refused(environment, format!("{what}: {error}"))
        };
        let config = config::of(environment)?;
        let folder = environment.directory.middleware(crate::NAME);
        let registry = LocalRegistry::open(&folder, config.domain)
            .map_err(|error| failed(&folder.display().to_string(), &error))?;
        let domain = part_of(config.domain, &config.xml).map_err(|error| {
            let help = udp::advice(config.domain);
            failed("Cyclone DDS does not start", &format!("{error}; {help}"))
        })?;
        let participant = domain
            .participant()
            .map_err(|error| failed("the domain cannot be joined", &error))?;
        let (messages, heard) = channel();
        let discover = |writers| {
            let listener = Box::new(Discovering(writers, messages.clone()));
            participant
                .discovery(writers, listener)
                .map_err(|error| failed("others cannot be discovered", &error))
        };
        let discoveries = Arc::new([discover(false)?, discover(true)?]);
        let known = Arc::new(Discovered::default());
        let host = rc_network::host(&folder);
        let watching = Watcher {
            host: host.clone(),
            known: Arc::clone(&known),
            discoveries: Arc::clone(&discoveries),
        };
        let watcher = std::thread::Builder::new()
            .name("rc-dds".to_owned())
            .spawn(move || watching.run(&heard))
            .map_err(|error| failed("a thread cannot be started", &error))?;
        Ok(Self {
            environment: environment.clone(),
            host,
            registry,
            known,
            patience: Cell::new(PATIENCE),
            start: Instant::now(),
            messages,
            watcher: Some(watcher),
            writers: RefCell::default(),
            _discoveries: discoveries,
            participant,
            _domain: domain,
        })
    }

    /// Refuses what does not fit those who are at `topic` already.
    fn check(&self, spec: &EndpointSpec<'_>) -> Result<(), OpenError> {
        let own = self.participant.guid().unwrap_or_default();
        let here = self.registry.registrations(&spec.topic, true, true);
        let mut infos: Vec<EndpointInfo> = here
            .into_iter()
            .map(|registration| registration.info)
            .collect();
        for ends in &self.known.ends {
            let ends = lock(ends);
            let there = ends
                .values()
                .filter(|end| end.topic == spec.topic && end.participant != own);
            let there = there.filter_map(|end| EndpointInfo::parse(&end.user_data));
            // Of those who share the board the notices are certain; one that was killed is discovered for a while.
            infos.extend(there.filter(|info| info.host != self.host));
        }
        for info in infos {
            if info.types != *spec.types {
                return Err(OpenError::TypeMismatch {
                    address: spec.address.to_owned(),
                    ours: spec.types.to_string(),
                    theirs: info.types.to_string(),
                });
            }
            if (spec.role, info.role) == (Role::Server, Role::Server) {
                return Err(OpenError::AddressTaken {
                    address: spec.address.to_owned(),
                    holder: info.who(&self.host),
                });
            }
        }
        Ok(())
    }

    /// Opens ends, all or none, and waits until they and those on this machine have found each other.
    pub(crate) fn ports<const N: usize>(
        self: &Rc<Self>,
        specs: [EndpointSpec<'_>; N],
    ) -> Result<[Port; N], OpenError> {
        let address = specs.first().map_or("", |spec| spec.address).to_owned();
        let backend = |error: &dyn std::fmt::Display| OpenError::Backend {
            address: address.clone(),
            reason: error.to_string(),
        };
        let open_lock = self.registry.open_lock().map_err(|error| backend(&error))?;
        for spec in &specs {
            self.check(spec)?;
        }
        let mut ports = Vec::new();
        for spec in specs {
            ports.push(self.port(spec, &backend)?);
        }
        drop(open_lock);
        self.meet(&ports);
        ports.try_into().map_err(|_| backend(&"an end is missing"))
    }

    fn port(
        self: &Rc<Self>,
        spec: EndpointSpec<'_>,
        backend: &dyn Fn(&dyn std::fmt::Display) -> OpenError,
    ) -> Result<Port, OpenError> {
        let info = EndpointInfo {
            role: spec.role,
            types: spec.types.clone(),
            instance: self.environment.instance.clone(),
            pid: std::process::id(),
            host: self.host.clone(),
        };
        let user_data = info.to_string();
        let qos = Qos {
            user_data: user_data.as_bytes(),
            ..spec.qos
        };
        let topic = self
            .participant
            .topic(&spec.topic, &spec.type_name)
            .map_err(|error| backend(&error))?;
        let state = Arc::new(EndpointState::new(
            spec.topic,
            spec.role,
            info.types.clone(),
            spec.sends,
            &qos,
            spec.signal,
            spec.inbox,
        ));
        let listener = Box::new(Listening(Arc::clone(&state), self.messages.clone()));
        let entity = if spec.sends {
            self.participant
                .writer(&topic, &qos, listener)
                .map(Entity::Writer)
        } else {
            self.participant
                .reader(&topic, &qos, listener)
                .map(Entity::Reader)
        };
        let opened = entity.and_then(|entity| Ok((entity.guid()?, Arc::new(entity))));
        let (guid, entity) = match opened {
            Ok(opened) => opened,
            Err(error) => {
                // The watcher does not wait for it any more.
                state.detach();
                return Err(backend(&error));
            }
        };
        state.attach(&entity);
        if (spec.role, spec.sends) == (Role::Server, false) {
            let mut serving = lock(&self.known.serving);
            serving.retain(|state| state.strong_count() > 0);
            serving.push(Arc::downgrade(&state));
        }
        if spec.sends {
            let mut writers = self.writers.borrow_mut();
            writers.retain(|writer| writer.strong_count() > 0);
            writers.push(Arc::downgrade(&entity));
        }
        let port = Port {
            entity,
            state,
            guid,
            session: Rc::clone(self),
        };
        let (topic, contract) = (&port.state.topic, &port.state.contract);
        let posted = self
            .registry
            .post(topic, &guid, spec.sends, &info, contract)
            .map_err(|error| backend(&error))?;
        port.state.post(posted);
        Ok(port)
    }

    /// Waits until new ends and those on this machine have found each other. Who cannot be reached costs a component a
    /// few seconds once.
    fn meet(&self, ports: &[Port]) {
        let begin = Instant::now();
        for port in ports {
            while !self.has_met(port) && begin.elapsed() < self.patience.get() {
                port.state.wait(LOOK);
            }
        }
        if ports.iter().any(|port| !self.has_met(port)) {
            let left = self.patience.get().saturating_sub(begin.elapsed());
            self.patience.set(left);
        }
    }

    fn has_met(&self, port: &Port) -> bool {
        let state = &port.state;
        let others = self
            .registry
            .registrations(&state.topic, !state.sends, state.sends);
        others.iter().all(|registration| {
            let (offered, requested) = if state.sends {
                (&state.contract, &registration.contract)
            } else {
                (&registration.contract, &state.contract)
            };
            !rc_network::differences(offered, requested).is_empty()
                || (state.has_found(&registration.guid) && registration.found.contains(&port.guid))
        })
    }

    /// Gives those on other machines a moment, once, until `found`.
    pub(crate) fn grace(&self, state: &EndpointState, found: impl Fn() -> bool) {
        while !found() && self.start.elapsed() < GRACE && !self.environment.wake_event.is_stopping()
        {
            state.wait(LOOK);
        }
    }

    /// Takes what was said of ends that do not fit.
    pub(crate) fn mismatches(&self) -> Vec<String> {
        self.known.mismatches.take()
    }

    /// Waits until what was sent has arrived.
    pub(crate) fn linger(&self, limit: Duration) {
        let begin = Instant::now();
        for writer in self.writers.borrow().iter().filter_map(Weak::upgrade) {
            if let Entity::Writer(writer) = &*writer {
                // Who does not confirm in time loses it; there is nobody to tell.
                let _ = writer.wait_for_acks(limit.saturating_sub(begin.elapsed()));
            }
        }
    }
}

impl Drop for Session {
    fn drop(&mut self) {
        let _ = self.messages.send(WatcherMessage::End);
        if let Some(watcher) = self.watcher.take() {
            let _ = watcher.join();
        }
    }
}

impl Drop for Port {
    fn drop(&mut self) {
        self.state.withdraw();
        self.state.detach();
        // The library waits for its threads before it deletes an end, so none of them may be the last to have it.
        while Arc::strong_count(&self.entity) > 1 {
            std::thread::yield_now();
        }
    }
}

/// A part of this process in a domain of DDS. The library knows one for each id, and several components may be in one
/// process: each has its own.
fn part_of(domain: u32, xml: &str) -> Result<Domain, rc_ddsc::Error> {
    let mut part = Domain::new(domain, xml);
    for id in FURTHER_PARTS {
        match &part {
            Err(error) if error.is_precondition() => part = Domain::new(id, xml),
            _ => break,
        }
    }
    part
}

struct Discovering(bool, Sender<WatcherMessage>);

impl Listener for Discovering {
    fn event(&self, _event: Event) {
        let _ = self.1.send(WatcherMessage::Discovered(self.0));
    }
}

struct Listening(Arc<EndpointState>, Sender<WatcherMessage>);

impl Listener for Listening {
    fn event(&self, event: Event) {
        if event == Event::Data {
            self.0.listen();
        } else {
            let _ = self
                .1
                .send(WatcherMessage::Event(Arc::clone(&self.0), event));
        }
    }
}

/// The thread that asks the library about what it announces, which its own threads must not.
struct Watcher {
    host: String,
    known: Arc<Discovered>,
    discoveries: Arc<[Discovery; 2]>,
}

impl Watcher {
    fn run(&self, heard: &Receiver<WatcherMessage>) {
        while let Ok(note) = heard.recv() {
            match note {
                WatcherMessage::Discovered(writers) => self.discover(writers),
                WatcherMessage::Event(state, event) => self.happened(&state, event),
                WatcherMessage::End => return,
            }
        }
    }

    fn discover(&self, writers: bool) {
        let at = usize::from(writers);
        let mut known = lock(&self.known.ends[at]);
        // What cannot be read now is read at the next announcement.
        let _ = self.discoveries[at].take(|end, guid| match end {
            Some(end) => {
                self.compare_servers(&end);
                known.insert(guid, end);
            }
            None => {
                known.remove(&guid);
            }
        });
    }

    /// Says where somebody on another machine serves an address of ours: before it was discovered, nobody could refuse it.
    fn compare_servers(&self, end: &End) {
        let info = EndpointInfo::parse(&end.user_data);
        let rival = info.filter(|h| h.role == Role::Server && h.host != self.host);
        let Some(rival) = rival else { return };
        for state in lock(&self.known.serving).iter().filter_map(Weak::upgrade) {
            if state.topic == end.topic && state.may_tell_of(&end.guid) {
                let address = state.topic.trim_end_matches("_Request");
                let text = format!(
                    "`{address}` has two servers, this one and {}; every request is executed by both. Stop one, or give it another address with --network, --name or --bind",
                    rival.who(&self.host)
                );
                self.known.mismatches.error(text);
            }
        }
    }

    fn happened(&self, state: &EndpointState, event: Event) {
        match event {
            Event::Data => {}
            Event::Matched(handle) => {
                if let Some(other) = state.matched(handle) {
                    self.differ(state, &other);
                }
            }
            Event::Unmatched(handle) => state.unmatched(handle),
            Event::Incompatible(_) => self.incompatible(state),
            Event::Deadline(count) => {
                if let (Some(passed), Some(limit)) = (state.rate_limit.allow(), state.deadline) {
                    let count = u64::from(count) + passed;
                    tracing::warn!(
                        "no value on `{}` within its deadline of {limit:?} ({count} times)",
                        state.topic
                    );
                }
            }
            Event::Alive(_, true) => tracing::info!("a publisher of `{}` is back", state.topic),
            Event::Alive(_, false) => {
                tracing::warn!(
                    "a publisher of `{}` has been silent for longer than its liveliness",
                    state.topic
                );
            }
        }
    }

    fn differ(&self, state: &EndpointState, other: &crate::endpoint_state::Peer) {
        if let Some(info) = &other.info
            && state.may_tell_of(&other.guid)
        {
            let (topic, who) = (&state.topic, info.who(&self.host));
            let (ours, theirs) = (&state.types, &info.types);
            let text = format!(
                "the ends of `{topic}` differ in type: this one has {ours}, {who} has {theirs}; they do not hear each other. Regenerate and rebuild both from the same .idsl"
            );
            self.known.mismatches.error(text);
        }
    }

    /// Says what of the others does not fit; the library does not say whom it means.
    fn incompatible(&self, state: &EndpointState) {
        self.discover(!state.sends);
        let known = lock(&self.known.ends[usize::from(!state.sends)]);
        for end in known.values().filter(|end| end.topic == state.topic) {
            let theirs = qos::contract_of(end);
            let (offered, requested) = if state.sends {
                (&state.contract, &theirs)
            } else {
                (&theirs, &state.contract)
            };
            let differences = rc_network::differences(offered, requested);
            if differences.is_empty() || !state.may_tell_of(&end.guid) {
                continue;
            }
            let who = match EndpointInfo::parse(&end.user_data) {
                Some(info) => format!("the {} {}", info.role.word(), info.who(&self.host)),
                None => format!("the end {}", rc_network::hex(&end.guid)),
            };
            let (topic, differences) = (&state.topic, differences.join("; "));
            let text = if state.sends {
                format!("what is sent on `{topic}` does not reach {who}: {differences}")
            } else {
                format!("`{topic}` hears nothing of {who}: {differences}")
            };
            self.known.mismatches.warn(text);
        }
    }
}
