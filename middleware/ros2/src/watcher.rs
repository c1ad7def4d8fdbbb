//! The thread of a component that listens: to what the library discovers, to what other components
//! tell of themselves, and to what comes to ends that nobody looks after. It also tells others of
//! this component, and ROS of its node.

use crate::config::Config;
use crate::endpoint_state::{EndpointState, Peer};
use crate::names::address_of_requests;
use crate::presence::{self, Told};
use crate::qos;
use crate::shared::{Early, Other, Shared};
use crate::wire::{self, Body, Copying, Reader, Sample, Writer};
use rc_network::{
    EndpointKind, Guid, GuidPrefix, Identity, Mismatches, QosContract, Role, hex, lock, prefix,
};
use ros2_client::entities_info::{NodeEntitiesInfo, ParticipantEntitiesInfo};
use ros2_client::{Gid, NodeName};
use rustdds::mio1::{Events, Interest, Poll, Token, Waker, event::Source};
use rustdds::policy::{Durability, Liveliness};
use rustdds::{
    DomainParticipant, DomainParticipantStatusEvent as Status, DomainParticipantStatusListener,
    GUID, QosPolicies, RTPSEntity, RepresentationIdentifier, StatusEvented, TopicKind,
};
use std::collections::{BTreeMap, HashMap};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, OnceLock};
use std::time::{Duration, Instant};

const WAKE: Token = Token(0);
const STATUS: Token = Token(1);
const ENDS: Token = Token(2);
const ALIVE: Token = Token(3);
/// In the last byte of an identity: the end is one of the library's own (RTPS 2.5, 9.3.1.2).
const BUILT_IN: u8 = 0xc0;
/// Of how many ends of others the types are remembered.
const MOST_TYPES: usize = 65_536;
/// Shortest time between two messages of what has changed; the first one is told at once.
const PAUSE: Duration = Duration::from_millis(5);
/// How long an end may take to be known after others have found it.
const OPENING: Duration = Duration::from_secs(1);
/// How many ends are remembered that were found before they were known.
const MOST_EARLY: usize = 1024;
/// How often it is looked at what has come to all ends.
const LISTEN: Duration = Duration::from_millis(250);
/// After so much silence nothing is known of a component any more. The library forgets it after 50
/// s; if it is back, it tells all again.
const FORGOTTEN: Duration = Duration::from_mins(5);
/// How often a component says in one lease that it lives.
const BEATS: u32 = 4;

/// The thread.
pub(crate) struct Watcher {
    shared: Arc<Shared>,
    poll: Poll,
    status: DomainParticipantStatusListener,
    member: Gid,
    node: NodeName,
    lease: Duration,
    /// The types of the ends of others: the library compares only topics.
    types: HashMap<Guid, String>,
    // Readers and writers go before the participant does.
    ends: (Reader, Writer),
    alive: (Reader, Writer),
    nodes: Writer,
    participant: DomainParticipant,
}

impl Watcher {
    pub(crate) fn new(
        participant: &DomainParticipant,
        publisher: &rustdds::Publisher,
        subscriber: &rustdds::Subscriber,
        config: &Config,
        host: &str,
    ) -> Result<Self, Box<dyn std::error::Error>> {
        let pair = |topic: &str, policies: QosPolicies| {
            let type_name = presence::TYPE.to_owned();
            let topic = participant.create_topic(
                topic.to_owned(),
                type_name,
                &policies,
                TopicKind::NoKey,
            )?;
            let reader: Reader =
                subscriber.create_simple_datareader_no_key(&topic, Some(policies.clone()))?;
            let writer: Writer = publisher.create_datawriter_no_key(&topic, Some(policies))?;
            Ok::<_, rustdds::dds::CreateError>((reader, writer))
        };
        let mut ends = pair(presence::ENDS, qos::ends())?;
        let mut alive = pair(presence::ALIVE, qos::alive())?;
        // The name and the type that `rmw` expects; not below `rt`.
        let nodes = participant.create_topic(
            "ros_discovery_info".to_owned(),
            "rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_".to_owned(),
            &qos::ends(),
            TopicKind::NoKey,
        )?;
        let nodes: Writer = publisher.create_datawriter_no_key(&nodes, Some(qos::ends()))?;
        let poll = Poll::new()?;
        let mut status = participant.status_listener();
        let registry = poll.registry();
        status
            .as_status_source_mio1()
            .register(registry, STATUS, Interest::READABLE)?;
        ends.0.register(registry, ENDS, Interest::READABLE)?;
        alive.0.register(registry, ALIVE, Interest::READABLE)?;
        let shared = Arc::new(Shared {
            host: host.to_owned(),
            ends: Mutex::default(),
            members: Mutex::default(),
            waker: Arc::new(Waker::new(registry, WAKE)?),
            next: AtomicUsize::default(),
            early: Mutex::default(),
            is_new: AtomicBool::new(true),
            has_found: AtomicBool::new(false),
            stops: AtomicBool::new(false),
            searches: AtomicBool::new(false),
            mismatches: Mismatches::new(host),
            lost: OnceLock::new(),
        });
        Ok(Self {
            shared,
            poll,
            status,
            member: Gid::from(participant.guid()),
            node: config.node.clone(),
            lease: config.lease,
            types: HashMap::new(),
            ends,
            alive,
            nodes,
            participant: participant.clone(),
        })
    }

    pub(crate) fn shared(&self) -> Arc<Shared> {
        Arc::clone(&self.shared)
    }

    pub(crate) fn run(mut self) {
        let mut events = Events::with_capacity(64);
        let mut beat = Instant::now();
        let mut told = beat;
        let mut listened = beat;
        while !self.shared.stops.load(Ordering::SeqCst) {
            let mut until = beat.min(listened + LISTEN);
            if self.is_to_tell() {
                until = until.min(told + PAUSE);
            }
            let left = until.saturating_duration_since(Instant::now());
            if self.poll.poll(&mut events, Some(left)).is_err() {
                // Interrupted, or short of memory for a moment.
                std::thread::sleep(Duration::from_millis(1));
            }
            for event in &events {
                match event.token() {
                    STATUS => self.discovered(),
                    ENDS => self.told(),
                    ALIVE => self.lives(),
                    _ => self.listen(EndpointState::is_watched),
                }
            }
            if beat <= Instant::now() {
                beat = Instant::now() + self.lease / BEATS;
                self.beat();
            }
            if listened.elapsed() >= LISTEN {
                listened = Instant::now();
                // What comes to an end that is not looked after does not pile up in the library.
                self.listen(|_| true);
            }
            self.look_at_early();
            if self.shared.searches.swap(false, Ordering::SeqCst) {
                for state in self.shared.all() {
                    state.search();
                }
            }
            if self.is_to_tell() && told.elapsed() >= PAUSE {
                told = Instant::now();
                self.tell();
            }
        }
        // ROS is told that the node goes; the library tells of its ends.
        let nobody = ParticipantEntitiesInfo::new(self.member, Vec::new());
        self.tell_nodes(&nobody);
        let _ = self
            .nodes
            .wait_for_acknowledgments(Duration::from_millis(100));
    }

    /// Whether an end is of this thread.
    fn is_of_this(&self, guid: &Guid) -> bool {
        let readers = [&self.ends.0, &self.alive.0].map(RTPSEntity::guid);
        let writers = [&self.ends.1, &self.alive.1, &self.nodes].map(RTPSEntity::guid);
        readers
            .iter()
            .chain(&writers)
            .any(|own| wire::guid(*own) == *guid)
    }

    /// What has found each other before the end of ours was known.
    fn look_at_early(&self) {
        let known = |early: &Early| self.shared.by_guid(&early.own).is_some();
        let mut early = lock(&self.shared.early);
        // One that has gone by now is never known.
        early.retain(|early| early.since.elapsed() < OPENING);
        let (now, later): (Vec<Early>, _) = early.drain(..).partition(known);
        *early = later;
        drop(early);
        for Early { own, other, .. } in now {
            self.matched(own, other);
        }
    }

    fn listen(&self, is_meant: impl Fn(&EndpointState) -> bool) {
        for state in self.shared.all() {
            if state.identity.kind == EndpointKind::Reader && is_meant(&state) {
                state.listen();
            }
        }
    }

    /// Says that this component lives, and looks who does not.
    fn beat(&mut self) {
        // Who does not hear this beat hears the next one.
        let _ = self.alive.1.write(presence::string(""), None);
        self.look_at_library();
        let mut silent = Vec::new();
        let mut members = lock(&self.shared.members);
        members.retain(|_, other| {
            other.heard.elapsed() < FORGOTTEN.max(other.lease.saturating_mul(2))
        });
        for (member, other) in members.iter_mut() {
            // Who says seldom that it lives is not dead in between.
            if !other.silent && other.heard.elapsed() > self.lease.max(other.lease) {
                other.silent = true;
                silent.push((
                    *member,
                    other.ends.values().next().map(|told| told.info.clone()),
                ));
            }
        }
        drop(members);
        for (member, info) in silent {
            if let Some(info) = info {
                let (who, lease) = (info.describe(&self.shared.host), self.lease);
                tracing::debug!("{who} has been silent for {lease:?}");
            }
            for state in self.shared.all() {
                state.silence(true, |guid| prefix(guid) == member);
            }
        }
    }

    /// Notes where the library does not discover any more. Its threads end for good when a wait of
    /// theirs is interrupted (`rustdds` 0.15.1, `Discovery::discovery_event_loop`), and nothing but
    /// a new process has new ones. The one that discovers takes no commands then.
    fn look_at_library(&mut self) {
        if self.shared.lost.get().is_none() && self.participant.assert_liveliness().is_err() {
            let reason = "ROS 2 finds nobody any more and is found by nobody: rustdds ends where its process was stopped and resumed, or its machine slept. Start this component anew";
            let _ = self.shared.lost.set(reason.to_owned());
        }
    }

    /// Takes the signs of life.
    fn lives(&mut self) {
        for sample in taken(&self.alive.0) {
            self.is_alive(sample.prefix());
        }
    }

    fn is_alive(&self, member: GuidPrefix) {
        let mut members = lock(&self.shared.members);
        let Some(other) = members.get_mut(&member) else {
            return;
        };
        other.heard = Instant::now();
        let is_back = std::mem::take(&mut other.silent);
        drop(members);
        if is_back {
            for state in self.shared.all() {
                state.silence(false, |guid| prefix(guid) == member);
            }
        }
    }

    /// Takes what components tell of their ends.
    fn told(&mut self) {
        let mut any = false;
        for sample in taken(&self.ends.0) {
            let Ok(body) = sample.taken.body() else {
                continue;
            };
            any = true;
            let (lease, ends) = presence::read(body);
            let member = sample.prefix();
            for (guid, told) in &ends {
                self.compare_servers(guid, told);
            }
            let mut members = lock(&self.shared.members);
            let other = members.entry(member).or_insert_with(|| Other {
                ends: BTreeMap::new(),
                lease: Duration::ZERO,
                heard: Instant::now(),
                silent: false,
            });
            other.ends = ends;
            other.lease = lease;
            drop(members);
            self.is_alive(member);
        }
        if any {
            self.learn();
        }
    }

    fn learn(&self) {
        let ends: Vec<(Guid, Arc<EndpointState>)> = lock(&self.shared.ends)
            .values()
            .map(|own| (own.guid, Arc::clone(&own.state)))
            .collect();
        for (own, state) in ends {
            let mut is_far = false;
            let misfits = state.learned(
                |other| self.shared.told(other, &own),
                |info| {
                    is_far |= info.host != self.shared.host;
                },
            );
            if is_far {
                self.shared.has_found.store(true, Ordering::SeqCst);
            }
            for misfit in misfits {
                self.differ(&state, &misfit);
            }
        }
    }

    /// Says where somebody on another machine serves an address of ours: before it was discovered,
    /// nobody could refuse it.
    fn compare_servers(&self, guid: &Guid, told: &Told) {
        let info = &told.info;
        if info.role != Role::Server || info.host == self.shared.host {
            return;
        }
        for state in self.shared.all() {
            let Identity {
                topic,
                kind,
                info: own,
                ..
            } = &state.identity;
            let serves = (own.role, *kind) == (Role::Server, EndpointKind::Reader);
            if serves && *topic == told.topic && state.should_report(guid) {
                let service = address_of_requests(topic);
                self.shared.mismatches.second_server(service, info);
            }
        }
    }

    fn differ(&self, state: &EndpointState, other: &Peer) {
        if let Some(info) = &other.info
            && state.should_report(&other.guid)
        {
            self.shared.mismatches.types_differ(&state.identity, info);
        }
    }

    /// Takes what the library has discovered.
    fn discovered(&mut self) {
        while let Some(status) = self.status.try_recv_status() {
            match status {
                Status::RemoteReaderMatched {
                    local_writer,
                    remote_reader,
                } => self.matched(wire::guid(local_writer), wire::guid(remote_reader)),
                Status::RemoteWriterMatched {
                    local_reader,
                    remote_writer,
                } => self.matched(wire::guid(local_reader), wire::guid(remote_writer)),
                Status::ReaderDetected { reader: end } | Status::WriterDetected { writer: end }
                    if self.types.len() < MOST_TYPES =>
                {
                    self.types.insert(wire::guid(end.guid), end.type_name);
                }
                Status::ReaderLost { guid, .. } | Status::WriterLost { guid, .. } => {
                    let guid = wire::guid(guid);
                    self.types.remove(&guid);
                    self.lost(|other| *other == guid);
                }
                Status::ParticipantLost { id, .. } => {
                    let member = prefix(&wire::guid(GUID {
                        prefix: id,
                        ..GUID::GUID_UNKNOWN
                    }));
                    lock(&self.shared.members).remove(&member);
                    self.types.retain(|guid, _| prefix(guid) != member);
                    self.lost(|other| prefix(other) == member);
                }
                Status::RemoteReaderQosIncompatible {
                    local_writer,
                    remote_reader,
                    requested_qos,
                    offered_qos,
                } => self.incompatible(local_writer, remote_reader, &offered_qos, &requested_qos),
                Status::RemoteWriterQosIncompatible {
                    local_reader,
                    remote_writer,
                    requested_qos,
                    offered_qos,
                } => self.incompatible(local_reader, remote_writer, &offered_qos, &requested_qos),
                _ => {}
            }
        }
    }

    fn matched(&self, own: Guid, other: Guid) {
        let Some(state) = self.shared.by_guid(&own) else {
            // It is just being opened.
            let mut early = lock(&self.shared.early);
            if early.len() < MOST_EARLY && own[15] & BUILT_IN == 0 && !self.is_of_this(&own) {
                let since = Instant::now();
                early.push(Early { own, other, since });
            }
            return;
        };
        let (info, has_found_us) = match self.shared.told(&other, &own) {
            Some((info, found)) => (Some(info), found),
            None => (None, false),
        };
        let is_far = info
            .as_ref()
            .is_some_and(|info| info.host != self.shared.host);
        let theirs = self
            .types
            .get(&other)
            .filter(|theirs| **theirs != state.type_name);
        let misfit = state.matched(other, info, has_found_us, theirs.is_none());
        // The library matches a new end of ours also with those of a process that was killed.
        if self.shared.is_silent(&other) {
            state.silence(true, |guid| *guid == other);
        }
        if let Some(misfit) = misfit {
            match theirs {
                Some(theirs) if state.should_report(&other) => {
                    let (topic, ours) = (state.topic(), &state.type_name);
                    self.shared.mismatches.error(format!(
                        "`{topic}` is {ours} here and {theirs} to the end {}; they do not hear each other",
                        hex(&other)
                    ));
                }
                _ => self.differ(&state, &misfit),
            }
        }
        // Components of this machine look for their peers in the registrations; so does this one.
        self.shared.searches.store(true, Ordering::SeqCst);
        if is_far {
            self.shared.has_found.store(true, Ordering::SeqCst);
        }
    }

    fn is_to_tell(&self) -> bool {
        let Shared {
            is_new, has_found, ..
        } = &*self.shared;
        is_new.load(Ordering::SeqCst) || has_found.load(Ordering::SeqCst)
    }

    fn lost(&self, is_it: impl Fn(&Guid) -> bool) {
        for state in self.shared.all() {
            state.lost(&is_it);
        }
    }

    /// Says what of another end does not fit, with both values.
    fn incompatible(&self, own: GUID, other: GUID, offered: &QosPolicies, requested: &QosPolicies) {
        let (own, other) = (wire::guid(own), wire::guid(other));
        let Some(state) = self.shared.by_guid(&own) else {
            return;
        };
        let differences = rc_network::differences(&contract(offered), &contract(requested));
        if !state.should_report(&other) {
            return;
        }
        let differences = match differences.join("; ") {
            none if none.is_empty() => "their quality of service differs".to_owned(),
            some => some,
        };
        let info = self.shared.told(&other, &own).map(|(info, _)| info);
        let mismatches = &self.shared.mismatches;
        mismatches.qos_differs(&state.identity, info.as_ref(), &other, &differences);
    }

    /// Tells others of the ends of this component, and ROS of its node. What does not go out is
    /// told again after a pause.
    fn tell(&self) {
        let is_new = self.shared.is_new.swap(false, Ordering::SeqCst);
        self.shared.has_found.store(false, Ordering::SeqCst);
        let mut node = NodeEntitiesInfo::new(self.node.clone());
        let ends = lock(&self.shared.ends);
        for own in ends.values() {
            let gid = Gid::from(GUID::from_bytes(own.guid));
            match own.state.identity.kind {
                EndpointKind::Writer => node.add_writer(gid),
                EndpointKind::Reader => node.add_reader(gid),
            }
        }
        let told = ends.values().map(|own| {
            let state = &own.state;
            let told = Told {
                info: state.identity.info.clone(),
                connection: state.connection,
                topic: state.topic().to_owned(),
                found: state.found(&self.shared.host),
            };
            (&own.guid, told)
        });
        let message = presence::message(self.lease, told);
        drop(ends);
        let sent = self.ends.1.write(message, None).is_ok();
        let nodes = ParticipantEntitiesInfo::new(self.member, vec![node]);
        if !sent || (is_new && !self.tell_nodes(&nodes)) {
            self.shared.is_new.store(true, Ordering::SeqCst);
        }
    }

    fn tell_nodes(&self, nodes: &ParticipantEntitiesInfo) -> bool {
        let mut bytes = Vec::new();
        let encoding = RepresentationIdentifier::CDR_LE;
        let written = rustdds::serialization::to_writer_with_rep_id(&mut bytes, nodes, encoding);
        written.is_ok() && self.nodes.write(Body::of(&[&bytes]), None).is_ok()
    }
}

/// The samples of a reader of this thread.
fn taken(reader: &Reader) -> Vec<Sample> {
    reader.drain_read_notifications();
    let mut samples = Vec::new();
    loop {
        match reader.try_take_one_with(Copying::default()) {
            Ok(Some(change)) => samples.push(Sample::of(change, 0)),
            Ok(None) => return samples,
            // It is passed over.
            Err(_) => {}
        }
    }
}

/// What policies promise; what they leave out has the default of DDS.
fn contract(policies: &QosPolicies) -> QosContract {
    let finite =
        |time: rustdds::Duration| (time != rustdds::Duration::INFINITE).then(|| time.to_std());
    QosContract {
        reliable: policies.is_reliable(),
        transient_local: policies
            .durability()
            .is_some_and(|durability| durability >= Durability::TransientLocal),
        deadline: policies.deadline().and_then(|deadline| finite(deadline.0)),
        liveliness: policies
            .liveliness()
            .and_then(|liveliness| match liveliness {
                Liveliness::Automatic { lease_duration }
                | Liveliness::ManualByParticipant { lease_duration }
                | Liveliness::ManualByTopic { lease_duration } => finite(lease_duration),
            }),
    }
}
