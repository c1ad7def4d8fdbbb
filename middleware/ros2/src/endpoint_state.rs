//! What an endpoint of this component shares with the thread that listens: its peers, and what it
//! has received.

use crate::held::UNKNOWN;
use crate::wire::{Copying, Reader, Sample, Spare, Writer};
use rc_middleware::WakeEvent;
use rc_network::{
    Backlog, EndpointInfo, Guid, Identity, LocalRegistry, Presence, lock, types_match,
};
use rustdds::mio1;
use std::collections::{BTreeSet, VecDeque};
use std::ops::Deref;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::task::Wake;
use std::time::{Duration, Instant};

/// How long an endpoint of another program is given to find ours after ours has found it. Nobody
/// says when it has.
const SETTLE: Duration = Duration::from_millis(100);
/// How often readers are looked at until all samples that have arrived are there.
const MOST_LOOKS: usize = 64;

/// How long a publisher that was found may send the samples that it has kept.
const CATCH_UP: Duration = Duration::from_secs(2);

/// The hash of types that no component generated: only their names in DDS are compared.
pub(crate) const STRANGER: u64 = 0;

/// Where an endpoint puts what it receives.
pub(crate) trait Inbox: Backlog {
    /// Keeps samples, or does not.
    fn put(&self, samples: Vec<Sample>);

    /// Counts what could not be read.
    fn unreadable(&self, _reason: String) {}
}

/// How many reasons are kept why something could not be read; each of them is counted as an error.
const MOST_REASONS: usize = 64;

/// Why something could not be read.
#[derive(Default)]
pub(crate) struct Reasons(Mutex<VecDeque<String>>);

impl Reasons {
    /// Keeps one, where there is room.
    pub(crate) fn put(&self, reason: String) {
        let mut reasons = lock(&self.0);
        if reasons.len() < MOST_REASONS {
            reasons.push_back(reason);
        }
    }

    /// Takes the oldest one.
    pub(crate) fn next(&self) -> Option<String> {
        lock(&self.0).pop_front()
    }
}

/// What nobody sends to.
impl Inbox for () {
    fn put(&self, _samples: Vec<Sample>) {}
}

/// Who is told that something has come.
#[derive(Clone)]
pub(crate) enum Listener {
    /// Who owns the end, and takes it.
    Owner(WakeEvent),
    /// The thread that listens, which puts it into the inbox.
    Watcher(Arc<mio1::Waker>),
}

/// What the library rings, on a thread of its own, when something has come for a reader; once,
/// until it is hung up again.
struct Notifier {
    has_rung: AtomicBool,
    listener: Listener,
}

impl Wake for Notifier {
    fn wake(self: Arc<Self>) {
        self.wake_by_ref();
    }

    fn wake_by_ref(self: &Arc<Self>) {
        self.has_rung.store(true, Ordering::SeqCst);
        match &self.listener {
            Listener::Owner(signal) => signal.wake(),
            // A thread that cannot be woken looks at its next beat.
            Listener::Watcher(waker) => drop(waker.wake()),
        }
    }
}

/// What is known of a peer besides.
#[derive(Clone, Debug)]
pub(crate) struct Details {
    /// When it was found.
    since: Instant,
    /// Whether it has told that it has found this endpoint.
    has_found_us: bool,
    /// Whether the registrations of this machine were searched for it.
    is_searched: bool,
}

/// Another endpoint that was found.
pub(crate) type Peer = rc_network::Peer<Details>;

/// Whether what is sent to a peer arrives.
pub(crate) fn is_ready(peer: &Peer) -> bool {
    match peer.info {
        Some(_) => peer.details.has_found_us,
        None => peer.details.since.elapsed() >= SETTLE,
    }
}

/// The sender of a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Sender {
    /// The hash of its types; 0 of another program.
    Known(u64),
    /// Its types differ.
    Mismatched,
    /// Discovery has not found it yet, or the registrations were not searched for it yet.
    Unknown,
}

type CommonState = rc_network::EndpointState<Guid, Details>;

/// What an endpoint shares with the thread that listens.
pub(crate) struct EndpointState {
    common: CommonState,
    /// The name of the type in DDS.
    pub(crate) type_name: String,
    /// The number of its connection in the component.
    pub(crate) connection: u32,
    /// When it was opened, in nanoseconds since 1970.
    opened: i64,
    listener: Listener,
    inbox: Arc<dyn Inbox>,
    group: Group,
    /// The number of this endpoint in its group.
    place: usize,
    /// The registrations of this machine.
    registry: LocalRegistry,
}

impl Deref for EndpointState {
    type Target = CommonState;

    fn deref(&self) -> &CommonState {
        &self.common
    }
}

/// Readers whose samples are put into one inbox in the order in which they came. Who takes has all
/// of them for that time.
pub(crate) type Group = Arc<Mutex<Vec<GroupedReader>>>;

/// A reader of a group.
pub(crate) struct GroupedReader {
    /// Its number there.
    place: usize,
    reader: Arc<Reader>,
    notifier: Arc<Notifier>,
    spare: Arc<Spare>,
}

impl GroupedReader {
    /// Whether something may have come since this was asked last.
    fn has_rung(&self) -> bool {
        self.notifier.has_rung.swap(false, Ordering::SeqCst)
    }
}

/// What a new endpoint has to know.
pub(crate) struct Listening {
    pub(crate) identity: Identity,
    pub(crate) type_name: String,
    pub(crate) connection: u32,
    pub(crate) signal: WakeEvent,
    pub(crate) listener: Listener,
    pub(crate) inbox: Arc<dyn Inbox>,
    pub(crate) group: Group,
    pub(crate) place: usize,
    pub(crate) registry: LocalRegistry,
}

impl EndpointState {
    pub(crate) fn new(listening: Listening) -> Self {
        let backlog = Arc::clone(&listening.inbox) as _;
        Self {
            common: CommonState::new(listening.identity, listening.signal, backlog),
            type_name: listening.type_name,
            connection: listening.connection,
            opened: rc_network::stamp(0),
            listener: listening.listener,
            inbox: listening.inbox,
            group: listening.group,
            place: listening.place,
            registry: listening.registry,
        }
    }

    /// From now on samples of this reader are heard.
    pub(crate) fn attach(&self, reader: &Arc<Reader>) {
        let notifier = Notifier {
            has_rung: AtomicBool::default(),
            listener: self.listener.clone(),
        };
        lock(&self.group).push(GroupedReader {
            place: self.place,
            reader: Arc::clone(reader),
            notifier: Arc::new(notifier),
            spare: Arc::default(),
        });
        self.listen();
    }

    /// From now on they are not.
    pub(crate) fn detach(&self, reader: &Arc<Reader>) {
        lock(&self.group).retain(|heard| !Arc::ptr_eq(&heard.reader, reader));
    }

    /// Whether the thread that listens fills the inbox, and not who owns the end.
    pub(crate) fn is_watched(&self) -> bool {
        matches!(self.listener, Listener::Watcher(_))
    }

    /// Puts what has come into the inbox, whether it has rung or not, and rings for whoever owns
    /// the end.
    pub(crate) fn listen(&self) {
        for heard in &*lock(&self.group) {
            // What the library writes beside the bell, for those who poll.
            heard.reader.drain_read_notifications();
            heard.notifier.has_rung.store(true, Ordering::SeqCst);
        }
        if self.hear() {
            self.signal.wake();
        }
    }

    /// Puts what has come into the inbox; says whether there was anything. What comes later rings.
    pub(crate) fn hear(&self) -> bool {
        let group = lock(&self.group);
        let mut samples = Vec::new();
        let mut is_any = false;
        // What came to one reader before something else came to another one is there when that is
        // seen: all are looked at again until nothing is new. That takes less time than the next
        // sample.
        for _ in 0..MOST_LOOKS {
            let mut is_new = false;
            for heard in group.iter().filter(|heard| heard.has_rung()) {
                is_new |= self.take(heard, &mut samples);
            }
            is_any |= is_new;
            if !is_new || group.len() == 1 {
                break;
            }
        }
        // Samples of other types take no room from those that can be read.
        samples.retain(|sample| {
            let matches = self.with(&sample.writer, |peer| peer.matches);
            matches.unwrap_or(true)
        });
        if !samples.is_empty() {
            samples.sort_by_key(|sample| sample.received);
            self.inbox.put(samples);
        }
        is_any
    }

    /// Takes what has come to a reader; says whether there was anything.
    fn take(&self, heard: &GroupedReader, samples: &mut Vec<Sample>) -> bool {
        let GroupedReader {
            place,
            reader,
            notifier,
            spare,
        } = heard;
        // Before the look, so that nothing comes between.
        reader.set_waker(Some(Arc::clone(notifier).into()));
        let mut is_any = false;
        loop {
            match reader.try_take_one_with(Copying(Arc::clone(spare))) {
                Ok(Some(change)) => samples.push(Sample::of(change, *place)),
                Ok(None) => return is_any,
                Err(error) => self.inbox.unreadable(error.to_string()),
            }
            is_any = true;
        }
    }

    /// Adds a peer that was found; gives it where its types differ.
    pub(crate) fn matched(
        &self,
        guid: Guid,
        info: Option<EndpointInfo>,
        has_found_us: bool,
        same_type: bool,
    ) -> Option<Peer> {
        let ours = &self.identity.info.types;
        let same = info
            .as_ref()
            .is_none_or(|info| types_match(&info.types, ours));
        let peer = Peer {
            guid,
            info,
            matches: same && same_type,
            presence: Presence::Present,
            details: Details {
                since: Instant::now(),
                has_found_us,
                is_searched: false,
            },
        };
        self.insert(guid, peer.clone());
        (!peer.matches).then_some(peer)
    }

    /// Components have told of their endpoints; gives the peers that turn out to have other types.
    /// `each` is given what a peer tells of itself when this is new.
    pub(crate) fn learned(
        &self,
        of: impl Fn(&Guid) -> Option<(EndpointInfo, bool)>,
        mut each: impl FnMut(&EndpointInfo),
    ) -> Vec<Peer> {
        let mut mismatched = Vec::new();
        let ours = &self.identity.info.types;
        self.update(|peer| {
            let Some((info, has_found_us)) = of(&peer.guid) else {
                return false;
            };
            let changed = peer.info.is_none() || peer.details.has_found_us != has_found_us;
            peer.details.has_found_us |= has_found_us;
            if peer.info.is_none() {
                peer.matches &= types_match(&info.types, ours);
                each(&info);
                peer.info = Some(info);
                if !peer.matches {
                    mismatched.push(peer.clone());
                }
            }
            changed
        });
        mismatched
    }

    /// Marks a peer, or all of a process, as gone.
    pub(crate) fn lost(&self, is_it: impl Fn(&Guid) -> bool) {
        self.update(|peer| {
            let lost = peer.presence != Presence::Gone && is_it(&peer.guid);
            if lost {
                peer.presence = Presence::Gone;
            }
            lost
        });
    }

    /// Marks the peers of a process as silent, or as present again.
    pub(crate) fn silence(&self, silent: bool, is_it: impl Fn(&Guid) -> bool) {
        let (from, to) = if silent {
            (Presence::Present, Presence::Silent)
        } else {
            (Presence::Silent, Presence::Present)
        };
        self.update(|peer| {
            let changes = peer.presence == from && is_it(&peer.guid);
            if changes {
                peer.presence = to;
            }
            changes
        });
    }

    /// Searches the registrations of this machine for peers, see [`search`].
    pub(crate) fn search(&self) {
        search(&self.common, &self.registry);
    }

    /// The peers on other machines than `host`, whether they match or not.
    pub(crate) fn found(&self, host: &str) -> BTreeSet<Guid> {
        let far = |peer: &Peer| peer.info.as_ref().is_some_and(|info| info.host != host);
        let found = self.peers(|peer| {
            let is_here = peer.presence != Presence::Gone;
            (is_here && far(peer)).then_some(peer.guid)
        });
        found.into_iter().collect()
    }

    /// Whether a sample was kept from before this endpoint was there, and arrives although it
    /// requested no kept samples.
    pub(crate) fn is_old(&self, sample: &Sample) -> bool {
        let since = self.with(&sample.writer, |peer| peer.details.since);
        let is_fresh = since.is_none_or(|since| since.elapsed() < CATCH_UP);
        // By the clock of another machine it may look so for longer.
        is_fresh && sample.stamp != 0 && sample.stamp < self.opened
    }

    /// Whether a peer was found, be it gone by now.
    pub(crate) fn knows(&self, guid: &Guid) -> bool {
        self.with(guid, |_| ()).is_some()
    }

    /// The sender of a sample of `writer`. It neither waits nor reads files.
    pub(crate) fn sender(&self, writer: &Guid) -> Sender {
        let sender = self.with(writer, |peer| match &peer.info {
            _ if !peer.matches => Sender::Mismatched,
            Some(info) => Sender::Known(info.types.hash),
            // A component may register right after it was found.
            None if peer.details.is_searched && peer.details.since.elapsed() >= UNKNOWN => {
                Sender::Known(STRANGER)
            }
            None => Sender::Unknown,
        });
        sender.unwrap_or(Sender::Unknown)
    }
}

/// Searches the registrations of this machine: who the peers of an endpoint are, and which of them
/// have found it.
pub(crate) fn search(state: &CommonState, registry: &LocalRegistry) {
    // A peer that has not registered by then is no component on this machine.
    let may_register = |peer: &Peer| peer.info.is_some() || peer.details.since.elapsed() < CATCH_UP;
    let waits = |peer: &Peer| {
        let Details { has_found_us, .. } = peer.details;
        peer.presence != Presence::Gone && !has_found_us && may_register(peer)
    };
    if !state.any(waits) {
        return;
    }
    let own = state.guid();
    let Identity {
        topic, kind, info, ..
    } = &state.identity;
    // A peer that is found while the registrations are read may have registered after its file
    // was looked for: the next search looks for it.
    let present = state.peers(|peer| Some(peer.guid));
    let registrations = registry.registrations(topic, kind.opposite());
    state.update(|peer| {
        let was_present = present.contains(&peer.guid);
        let mut changes = was_present && !peer.details.is_searched;
        peer.details.is_searched |= was_present;
        let registered = registrations.iter().find(|one| one.guid == peer.guid);
        if let Some(registration) = registered {
            if peer.info.is_none() {
                peer.matches &= types_match(&registration.info.types, &info.types);
                peer.info = Some(registration.info.clone());
                changes = true;
            }
            let has_found_us = own.is_some_and(|own| registration.found.contains(&own));
            changes |= has_found_us && !peer.details.has_found_us;
            peer.details.has_found_us |= has_found_us;
        }
        changes
    });
}

/// The sending or receiving end of a topic of DDS.
pub(crate) enum Entity {
    Writer(Arc<Writer>),
    Reader(Arc<Reader>),
}

#[cfg(test)]
mod tests {
    use super::*;
    use rc_middleware::TypeIdentity;
    use rc_network::{EndpointKind, QosContract, Role};

    fn identity(kind: EndpointKind, role: Role) -> Identity {
        Identity {
            topic: "rt/default/Ticks".to_owned(),
            kind,
            info: EndpointInfo {
                role,
                types: TypeIdentity {
                    name: "Test::Ticks".to_owned(),
                    hash: 7,
                },
                instance: "test".to_owned(),
                pid: 1,
                host: "here".to_owned(),
            },
            contract: QosContract::default(),
        }
    }

    /// The worker asks for the sender of each sample. Only the thread that listens searches for it.
    #[test]
    fn an_unknown_sender_costs_the_worker_no_wait() {
        let folder = std::env::temp_dir().join(format!("rc-ros2-sender-{}", std::process::id()));
        let registry = LocalRegistry::open(&folder, 0).expect("a registry");
        let signal = WakeEvent::new().expect("a descriptor");
        let state = EndpointState::new(Listening {
            identity: identity(EndpointKind::Reader, Role::Subscriber),
            type_name: String::new(),
            connection: 1,
            signal: signal.clone(),
            listener: Listener::Owner(signal),
            inbox: Arc::new(()),
            group: Group::default(),
            place: 0,
            registry: registry.clone(),
        });
        let (known, unknown) = ([1; 16], [2; 16]);
        let publisher = identity(EndpointKind::Writer, Role::Publisher);
        let _registration = registry.register(&known, &publisher).expect("to register");
        state.matched(known, None, false, true);
        let begin = Instant::now();
        for _ in 0..1000 {
            assert_eq!(state.sender(&unknown), Sender::Unknown);
            assert_eq!(state.sender(&known), Sender::Unknown);
        }
        assert!(begin.elapsed() < Duration::from_secs(1));
        state.search();
        assert_eq!(state.sender(&known), Sender::Known(7));
        // No component of this machine registered it: it belongs to another program.
        state.matched(unknown, None, false, true);
        state.search();
        assert_eq!(state.sender(&unknown), Sender::Unknown);
        std::thread::sleep(UNKNOWN);
        assert_eq!(state.sender(&unknown), Sender::Known(STRANGER));
        std::fs::remove_dir_all(&folder).expect("to remove");
    }
}
