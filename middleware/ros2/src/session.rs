//! One component's part in a domain: the participant, its node, what is known of others, and the
//! thread that listens.

use crate::bound::bounded;
use crate::config::{self, Config, Mapping};
use crate::endpoint_state::{EndpointState, Entity, Group, Inbox, Listener, Listening, search};
use crate::qos::Ends;
use crate::shared::Shared;
use crate::watcher::Watcher;
use crate::wire::{self, Body, Reader, Writer};
use rc_middleware::{Environment, OpenError, TypeIdentity, WakeEvent};
use rc_network::{EndpointKind, Guid, Identity, Opener, Opening, Patience, Role, prefix};
use rc_settings::ros::ResolvedRemapping;
use rustdds::rpc::SampleIdentity;
use rustdds::{
    DomainParticipant, DomainParticipantBuilder, GUID, RTPSEntity, SequenceNumber, Topic,
    TopicKind, WriteOptionsBuilder, dds::WriteError,
};
use std::cell::{Cell, RefCell};
use std::rc::Rc;
use std::sync::{Arc, Weak};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// A process whose first announcement was lost, as where very many start at once, announces itself
/// again after ten seconds.
const PATIENCE: Patience = Patience {
    local: Duration::from_secs(12),
    remote: Duration::from_millis(400),
};
/// How many bytes may wait for somebody who confirms nothing, before that one is left behind.
const MOST_UNCONFIRMED: usize = 128 << 20;
/// How long they are waited for then.
const ROOM: Duration = Duration::from_millis(20);

/// What the ends of one component share.
pub(crate) struct Session {
    pub(crate) environment: Environment,
    pub(crate) config: Config,
    pub(crate) opener: Opener,
    pub(crate) shared: Arc<Shared>,
    connections: Cell<u32>,
    /// The writers, for who lingers.
    writers: RefCell<Vec<Weak<Writer>>>,
    watcher: Option<JoinHandle<()>>,
    // In the order in which they go.
    publisher: rustdds::Publisher,
    subscriber: rustdds::Subscriber,
    participant: DomainParticipant,
}

/// One end of a topic of DDS. It leaves the domain when it goes.
pub(crate) struct Port {
    entity: Option<Entity>,
    pub(crate) state: Arc<EndpointState>,
    pub(crate) guid: Guid,
    pub(crate) session: Rc<Session>,
    topic: Topic,
    qos: rustdds::QosPolicies,
    /// What was sent since everything was confirmed.
    unconfirmed: usize,
    /// The number in `Shared`.
    number: usize,
}

/// What an end is to be.
pub(crate) struct EndpointSpec<'a> {
    /// What people call it.
    pub(crate) address: &'a str,
    /// The name of the topic in DDS, and of its type.
    pub(crate) topic: (String, String),
    pub(crate) role: Role,
    pub(crate) types: &'a TypeIdentity,
    pub(crate) kind: EndpointKind,
    pub(crate) qos: Ends,
    pub(crate) signal: WakeEvent,
    /// Whether what comes is put into the inbox by the thread that listens, and not by who owns the
    /// end.
    pub(crate) is_watched: bool,
    pub(crate) inbox: Arc<dyn Inbox>,
    /// Those that put into the same inbox, and the number of this one among them.
    pub(crate) group: (Group, usize),
}

/// Why something was not sent.
#[derive(Debug)]
pub(crate) enum Unsent {
    /// Somebody has confirmed nothing for too long.
    Full,
    /// What the library says.
    Failed(String),
}

impl Session {
    pub(crate) fn open(environment: &Environment) -> Result<Self, OpenError> {
        let failed = |what: &str, error: &dyn std::fmt::Display| {
            config::refused(environment, format!("{what}: {error}"))
        };
        let config = config::of(environment)?;
        let folder = environment.directory.middleware(crate::NAME);
        let opener = Opener::new(environment, &folder, config.domain.into(), PATIENCE)
            .map_err(|error| failed(&folder.display().to_string(), &error))?;
        let mut builder = DomainParticipantBuilder::new(config.domain);
        if let Some(networks) = &config.networks {
            builder = builder.with_only_networks(networks.clone());
        }
        let participant = builder.build().map_err(|error| {
            failed(
                &format!(
                    "domain {} cannot be joined; look at `interfaces` and ROS_DOMAIN_ID",
                    config.domain
                ),
                &error,
            )
        })?;
        let none = rustdds::QosPolicies::qos_none();
        let publisher = participant
            .create_publisher(&none)
            .map_err(|error| failed("nothing can be sent", &error))?;
        let subscriber = participant
            .create_subscriber(&none)
            .map_err(|error| failed("nothing can be received", &error))?;
        let host = opener.host();
        let make = || Watcher::new(&participant, &publisher, &subscriber, &config, host);
        let alone = |error: &dyn std::fmt::Display| failed("others cannot be discovered", error);
        let watcher = bounded(make).map_err(|error| alone(&error))?;
        let watcher = watcher.map_err(|error| alone(&error))?;
        let shared = watcher.shared();
        let watcher = std::thread::Builder::new()
            .name("rc-ros2".to_owned())
            .spawn(move || watcher.run())
            .map_err(|error| failed("a thread cannot be started", &error))?;
        Ok(Self {
            environment: environment.clone(),
            config,
            opener,
            shared,
            connections: Cell::new(0),
            writers: RefCell::default(),
            watcher: Some(watcher),
            publisher,
            subscriber,
            participant,
        })
    }

    /// The names that somebody has chosen.
    pub(crate) fn rules(&self) -> &[ResolvedRemapping] {
        &self.config.rules
    }

    /// What an end has to have in common with those that it meets. Of a service, the mapping is a
    /// part of it: with another one, the mark of a request would be executed as its first
    /// parameters.
    fn types(&self, spec: &EndpointSpec<'_>) -> TypeIdentity {
        let mut types = spec.types.clone();
        let calls = matches!(spec.role, Role::Client | Role::Server);
        if calls && self.config.mapping == Mapping::Cyclone {
            types.name.push_str("(service_mapping=cyclone)");
        }
        types
    }

    /// Opens endpoints, all or none, and waits until they and their peers on this machine have
    /// found each other.
    pub(crate) fn ports(
        self: &Rc<Self>,
        specs: Vec<EndpointSpec<'_>>,
    ) -> Result<Vec<Port>, OpenError> {
        let address = specs.first().map_or("", |spec| spec.address);
        let opening = self.opener.begin(address)?;
        for spec in &specs {
            let topic = &spec.topic.0;
            let info = self.opener.info(spec.role, self.types(spec));
            let own = prefix(&wire::guid(self.participant.guid()));
            let remote = self.shared.told_at(topic, own, self.opener.host());
            opening.check(topic, &info, remote)?;
        }
        self.connections.set(self.connections.get().wrapping_add(1));
        let mut ports = Vec::new();
        for spec in specs {
            ports.push(self.port(spec, &opening)?);
        }
        self.shared.changed();
        let states: Vec<_> = ports.iter().map(|port| &**port.state).collect();
        opening.meet(&states, |state| search(state, self.opener.registry()));
        Ok(ports)
    }

    /// Opens one end, see [`Session::ports`].
    pub(crate) fn end(self: &Rc<Self>, spec: EndpointSpec<'_>) -> Result<Port, OpenError> {
        let address = spec.address.to_owned();
        let port = self.ports(vec![spec])?.pop();
        port.ok_or_else(|| OpenError::Backend {
            address,
            reason: "an end is missing".to_owned(),
        })
    }

    fn port(
        self: &Rc<Self>,
        spec: EndpointSpec<'_>,
        opening: &Opening<'_>,
    ) -> Result<Port, OpenError> {
        let info = self.opener.info(spec.role, self.types(&spec));
        let (name, type_name) = spec.topic;
        let Ends { policies, contract } = spec.qos;
        let topic = self
            .participant
            .create_topic(name.clone(), type_name.clone(), &policies, TopicKind::NoKey)
            .map_err(|error| opening.failed(&error))?;
        let state = Arc::new(EndpointState::new(Listening {
            identity: Identity {
                topic: name,
                kind: spec.kind,
                info,
                contract,
            },
            type_name,
            connection: self.connections.get(),
            listener: if spec.is_watched {
                Listener::Watcher(Arc::clone(&self.shared.waker))
            } else {
                Listener::Owner(spec.signal.clone())
            },
            signal: spec.signal,
            inbox: spec.inbox,
            group: spec.group.0,
            place: spec.group.1,
            registry: self.opener.registry().clone(),
        }));
        let number = self.shared.number();
        let entity = self
            .entity(&topic, &policies, spec.kind)
            .map_err(|error| opening.failed(&error))?;
        self.opened(&entity, number, &state);
        let guid = entity.guid();
        let port = Port {
            entity: Some(entity),
            state,
            guid,
            session: Rc::clone(self),
            topic,
            qos: policies,
            unconfirmed: 0,
            number,
        };
        port.register().map_err(|error| opening.failed(&error))?;
        Ok(port)
    }

    /// A writer or a reader.
    fn entity(
        &self,
        topic: &Topic,
        policies: &rustdds::QosPolicies,
        kind: EndpointKind,
    ) -> Result<Entity, String> {
        let policies = Some(policies.clone());
        if kind == EndpointKind::Writer {
            let make = || self.publisher.create_datawriter_no_key(topic, policies);
            let writer: Writer = bounded(make)?.map_err(|error| error.to_string())?;
            let writer = Arc::new(writer);
            let mut writers = self.writers.borrow_mut();
            writers.retain(|writer| writer.strong_count() > 0);
            writers.push(Arc::downgrade(&writer));
            return Ok(Entity::Writer(writer));
        }
        let make = || {
            self.subscriber
                .create_simple_datareader_no_key(topic, policies)
        };
        let reader: Reader = bounded(make)?.map_err(|error| error.to_string())?;
        Ok(Entity::Reader(Arc::new(reader)))
    }

    /// From now on an end is known, and heard.
    fn opened(&self, entity: &Entity, number: usize, state: &Arc<EndpointState>) {
        self.shared.opened(number, entity.guid(), state);
        if let Entity::Reader(reader) = entity {
            state.attach(reader);
        }
    }

    /// Takes what was said of ends that do not fit.
    pub(crate) fn mismatches(&self) -> Vec<String> {
        self.shared.mismatches.take()
    }

    /// Waits until what was sent has arrived.
    pub(crate) fn linger(&self, limit: Duration) {
        let begin = Instant::now();
        for writer in self.writers.borrow().iter().filter_map(Weak::upgrade) {
            // Who does not confirm in time loses it; there is nobody to tell.
            let _ = writer.wait_for_acknowledgments(limit.saturating_sub(begin.elapsed()));
        }
    }
}

impl Drop for Session {
    fn drop(&mut self) {
        self.shared.stop();
        if let Some(watcher) = self.watcher.take() {
            let _ = watcher.join();
        }
    }
}

impl Entity {
    fn guid(&self) -> Guid {
        match self {
            Self::Writer(writer) => wire::guid(writer.guid()),
            Self::Reader(reader) => wire::guid(reader.guid()),
        }
    }
}

impl Port {
    /// Registers this endpoint on this machine.
    fn register(&self) -> std::io::Result<()> {
        let registry = self.session.opener.registry();
        let registration = registry.register(&self.guid, &self.state.identity)?;
        self.state.register(registration);
        Ok(())
    }

    pub(crate) fn writer(&self) -> Option<&Arc<Writer>> {
        match &self.entity {
            Some(Entity::Writer(writer)) => Some(writer),
            _ => None,
        }
    }

    /// Sends a body, to one end where `to` names it. `related` is the request that it answers.
    /// Gives the number of the sample.
    pub(crate) fn send(
        &mut self,
        body: Body,
        stamp: i64,
        related: Option<(Guid, i64)>,
        to: Option<Guid>,
    ) -> Result<i64, Unsent> {
        let length = body.len();
        // Looked at before it is sent: what is told to be refused never went out, and what went out
        // just now is confirmed by nobody yet.
        if self.unconfirmed + length > MOST_UNCONFIRMED {
            if !self.is_confirmed(ROOM) && self.unconfirmed > 0 {
                return Err(Unsent::Full);
            }
            self.unconfirmed = 0;
        }
        let Some(writer) = self.writer() else {
            return Err(Unsent::Failed("this end does not send".to_owned()));
        };
        let sent = write(writer, body, stamp, related, to);
        self.unconfirmed += length;
        sent
    }

    /// Whether everybody has confirmed what was sent, after at most `limit`.
    pub(crate) fn is_confirmed(&self, limit: Duration) -> bool {
        let confirmed = self
            .writer()
            .map(|writer| writer.wait_for_acknowledgments(limit));
        matches!(confirmed, Some(Ok(true)))
    }

    /// Takes a new writer in the place of one that is held up by somebody who confirms nothing: the
    /// library drops such a one only after most of a minute. The others find the new one in a
    /// moment; what is sent until then is lost to them.
    pub(crate) fn renew(&mut self) -> Result<(), String> {
        if let Some(passed) = self.state.report_limit.allow() {
            let (count, topic) = (passed + 1, self.state.topic());
            tracing::warn!(
                "somebody who hears `{topic}` confirms nothing any more and is left behind ({count} times)"
            );
        }
        // Where there is no other one, the old one stays, and the next thing that is sent tries
        // again.
        let entity = self
            .session
            .entity(&self.topic, &self.qos, EndpointKind::Writer)?;
        self.state.unregister();
        self.state.clear();
        self.session.opened(&entity, self.number, &self.state);
        self.guid = entity.guid();
        self.entity = Some(entity);
        self.unconfirmed = 0;
        self.register().map_err(|error| error.to_string())?;
        self.session.shared.changed();
        Ok(())
    }

    fn leave(&mut self) {
        self.state.unregister();
        self.session.shared.closed(self.number);
        if let Some(Entity::Reader(reader)) = &self.entity {
            self.state.detach(reader);
        }
        self.entity = None;
    }
}

impl Drop for Port {
    fn drop(&mut self) {
        self.leave();
        self.session.shared.changed();
    }
}

/// Sends a body with a writer, see [`Port::send`].
pub(crate) fn write(
    writer: &Writer,
    body: Body,
    stamp: i64,
    related: Option<(Guid, i64)>,
    to: Option<Guid>,
) -> Result<i64, Unsent> {
    let related = related.map(|(writer, number)| SampleIdentity {
        writer_guid: GUID::from_bytes(writer),
        sequence_number: SequenceNumber::new(number),
    });
    let mut options = WriteOptionsBuilder::new()
        .source_timestamp(wire::timestamp(stamp))
        .related_sample_identity_opt(related);
    if let Some(to) = to {
        options = options.to_single_reader(GUID::from_bytes(to));
    }
    match writer.write_with_options(body, options.build()) {
        Ok(identity) => Ok(i64::from(identity.sequence_number)),
        Err(WriteError::WouldBlock { .. }) => Err(Unsent::Full),
        Err(error) => Err(Unsent::Failed(error.forget_data().to_string())),
    }
}

/// What wakes an end.
pub(crate) fn signal(address: &str) -> Result<WakeEvent, OpenError> {
    WakeEvent::new().map_err(|error| OpenError::Backend {
        address: address.to_owned(),
        reason: error.to_string(),
    })
}
