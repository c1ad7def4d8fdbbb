//! What an end of ours knows of the other ends, and what it has heard.

use crate::wire::{Copying, Member, Reader, Sample, Spare, Writer, member};
use rc_middleware::{TypeIdentity, WakeEvent};
use rc_network::{
    EndpointInfo, Guid, LocalRegistry, QosContract, RateLimit, RegistrationGuard, Role, lock,
};
use rustdds::mio1;
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex};
use std::task::Wake;
use std::time::{Duration, Instant};

/// How many ends that have gone are remembered, because what they sent may still be unread; and how many that do not fit,
/// because they have been told of.
const REMEMBERED: usize = 256;
/// How long an end of somebody else is given to find ours after ours has found it. Nobody says when it has.
const SETTLE: Duration = Duration::from_millis(100);
/// How long an end may take to be known here after the library has found it, which is before it gives its samples; and how often
/// that is looked at.
const KNOWN: Duration = Duration::from_millis(20);
const LOOK: Duration = Duration::from_millis(2);
/// How often readers are looked at until all that has come is there.
const MOST_LOOKS: usize = 64;

/// How long a publisher that was found may send what it has kept.
const CATCH_UP: Duration = Duration::from_secs(2);

/// The hash of types that are no component's own: only their names in DDS are compared.
pub(crate) const STRANGER: u64 = 0;

/// Whether two ends have the same types, as far as they tell.
pub(crate) fn fit(ours: &TypeIdentity, theirs: &TypeIdentity) -> bool {
    ours == theirs || ours.hash == STRANGER || theirs.hash == STRANGER
}

/// Where an end puts what it hears.
pub(crate) trait Inbox: Send + Sync {
    /// Keeps samples, or does not.
    fn put(&self, samples: Vec<Sample>);

    /// Counts what could not be read.
    fn unreadable(&self, _reason: String) {}

    /// Whether something in it may be read now that the other ends have changed.
    fn waits(&self) -> bool {
        false
    }
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

/// What the library rings, on a thread of its own, when something has come for a reader; once, until it is hung up again.
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

/// Another end that was found.
#[derive(Clone, Debug)]
pub(crate) struct Peer {
    pub(crate) guid: Guid,
    /// None of a stranger.
    pub(crate) info: Option<EndpointInfo>,
    /// When it was found.
    since: Instant,
    /// Whether it has told that it has found this end.
    has_found_us: bool,
    /// Whether its process is silent.
    silent: bool,
    /// Whether its types are the same, as far as it tells.
    pub(crate) fits: bool,
    /// Whether it is still there.
    here: bool,
}

impl Peer {
    /// Whether it is there and fits.
    fn is_here(&self) -> bool {
        self.here && self.fits && !self.silent
    }

    /// Whether what is sent to it arrives.
    pub(crate) fn is_ready(&self) -> bool {
        match self.info {
            Some(_) => self.has_found_us,
            None => self.since.elapsed() >= SETTLE,
        }
    }

    pub(crate) fn member(&self) -> Member {
        member(&self.guid)
    }
}

/// What is shared between an end and the thread that listens.
pub(crate) struct EndpointState {
    /// The name of the topic in DDS, and of its type.
    pub(crate) topic: String,
    pub(crate) type_name: String,
    pub(crate) role: Role,
    pub(crate) types: TypeIdentity,
    /// The component that it is of, and the number of its connection there.
    pub(crate) instance: String,
    pub(crate) connection: u32,
    /// Whether it sends, or else receives.
    pub(crate) sends: bool,
    pub(crate) contract: QosContract,
    /// When it was opened, in nanoseconds since 1970.
    opened: i64,
    /// Rings when something has come or the other ends have changed.
    pub(crate) signal: WakeEvent,
    listener: Listener,
    inbox: Arc<dyn Inbox>,
    group: Group,
    /// The number of this end in its group.
    place: usize,
    /// The notices of those on this machine, and what its own stands under.
    registry: LocalRegistry,
    own: Mutex<Guid>,
    peers: Mutex<Peers>,
    changed: Condvar,
    pub(crate) rate_limit: RateLimit,
}

#[derive(Default)]
struct Peers {
    by_guid: BTreeMap<Guid, Peer>,
    /// Those who do not fit and have been told of.
    told_of: BTreeSet<Guid>,
    posted: Option<RegistrationGuard>,
}

impl Peers {
    /// Writes on the notice of this end whom it has found.
    fn note(&mut self, guid: &Guid) {
        if let Some(posted) = &mut self.posted {
            let here = self.by_guid.values().filter(|peer| peer.here);
            // The notice only helps others to start; they wait for a bounded time.
            let _ = posted.found(guid, here.map(|peer| &peer.guid));
        }
    }
}

/// Readers whose samples are put into one inbox in the order in which they came. Who takes has all of them for that time.
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

/// What a new ear has to know.
pub(crate) struct Listening {
    pub(crate) topic: String,
    pub(crate) type_name: String,
    pub(crate) role: Role,
    pub(crate) types: TypeIdentity,
    pub(crate) instance: String,
    pub(crate) connection: u32,
    pub(crate) sends: bool,
    pub(crate) contract: QosContract,
    pub(crate) signal: WakeEvent,
    pub(crate) listener: Listener,
    pub(crate) inbox: Arc<dyn Inbox>,
    pub(crate) group: Group,
    pub(crate) place: usize,
    pub(crate) registry: LocalRegistry,
}

impl EndpointState {
    pub(crate) fn new(listening: Listening) -> Self {
        Self {
            topic: listening.topic,
            type_name: listening.type_name,
            role: listening.role,
            types: listening.types,
            instance: listening.instance,
            connection: listening.connection,
            sends: listening.sends,
            contract: listening.contract,
            opened: rc_network::stamp(0),
            signal: listening.signal,
            listener: listening.listener,
            inbox: listening.inbox,
            group: listening.group,
            place: listening.place,
            registry: listening.registry,
            own: Mutex::default(),
            peers: Mutex::default(),
            changed: Condvar::new(),
            rate_limit: RateLimit::default(),
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

    /// Puts what has come into the inbox, whether it has rung or not, and rings for whoever owns the end.
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
        // What came to one reader before something else came to another one is there when that is seen: all are looked at again
        // until nothing is new. That takes less time than the next sample.
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
        // Who does not fit takes no place from who does.
        let peers = lock(&self.peers);
        samples.retain(|sample| {
            let peer = peers.by_guid.get(&sample.writer);
            peer.is_none_or(|peer| peer.fits)
        });
        drop(peers);
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

    /// Another end was found. Gives it where its types differ.
    pub(crate) fn matched(
        &self,
        guid: Guid,
        info: Option<EndpointInfo>,
        has_found_us: bool,
        same_type: bool,
    ) -> Option<Peer> {
        let same = info
            .as_ref()
            .is_none_or(|info| fit(&info.types, &self.types));
        let fits = same && same_type;
        let peer = Peer {
            guid,
            info,
            since: Instant::now(),
            has_found_us,
            silent: false,
            fits,
            here: true,
        };
        let mut peers = lock(&self.peers);
        peers.by_guid.insert(guid, peer.clone());
        peers.note(&guid);
        let gone = peers.by_guid.values().filter(|peer| !peer.here).count();
        if gone > REMEMBERED {
            peers.by_guid.retain(|_, peer| peer.here);
        }
        drop(peers);
        self.tell();
        (!fits).then_some(peer)
    }

    /// What is known of ends that were found has changed; gives those that turn out not to fit.
    /// `each` is given who a peer turns out to be.
    pub(crate) fn learned(
        &self,
        of: impl Fn(&Guid) -> Option<(EndpointInfo, bool)>,
        mut each: impl FnMut(&EndpointInfo),
    ) -> Vec<Peer> {
        let mut misfits = Vec::new();
        let mut changed = false;
        for peer in lock(&self.peers).by_guid.values_mut() {
            let Some((info, has_found_us)) = of(&peer.guid) else {
                continue;
            };
            changed |= peer.info.is_none() || peer.has_found_us != has_found_us;
            peer.has_found_us |= has_found_us;
            if peer.info.is_none() {
                peer.fits &= fit(&info.types, &self.types);
                each(&info);
                peer.info = Some(info);
                if !peer.fits {
                    misfits.push(peer.clone());
                }
            }
        }
        if changed {
            self.tell();
        }
        misfits
    }

    /// An end has gone, or all of a process.
    pub(crate) fn lost(&self, is_it: impl Fn(&Guid) -> bool) {
        self.change(|peer| {
            let lost = peer.here && is_it(&peer.guid);
            peer.here &= !lost;
            lost
        });
    }

    /// A process is silent, or heard again.
    pub(crate) fn silence(&self, silent: bool, is_it: impl Fn(&Guid) -> bool) {
        self.change(|peer| {
            let changes = peer.silent != silent && is_it(&peer.guid);
            peer.silent ^= changes;
            changes
        });
    }

    fn change(&self, each: impl FnMut(&mut Peer) -> bool) {
        let changed = lock(&self.peers)
            .by_guid
            .values_mut()
            .map(each)
            .filter(|changed| *changed)
            .count();
        if changed > 0 {
            self.tell();
        }
    }

    fn tell(&self) {
        self.changed.notify_all();
        // A call that waits may wait in vain now, and a request that was held may be served.
        if self.role == Role::Client || self.inbox.waits() {
            self.signal.wake();
        }
    }

    /// Forgets the other ends: this one has become a new one.
    pub(crate) fn forget(&self) {
        lock(&self.peers).by_guid.clear();
        self.tell();
    }

    /// The notice of this end; whom it has found already is written on it.
    pub(crate) fn post(&self, own: Guid, posted: RegistrationGuard) {
        *lock(&self.own) = own;
        let mut peers = lock(&self.peers);
        peers.posted = Some(posted);
        let found: Vec<Guid> = peers.by_guid.keys().copied().collect();
        for guid in &found {
            peers.note(guid);
        }
    }

    /// Looks at the notices of those on this machine who they are, and which of them have found this end.
    pub(crate) fn look(&self) {
        // Who has hung out no notice by then is no component on this machine.
        let may_tell = |peer: &Peer| peer.info.is_some() || peer.since.elapsed() < CATCH_UP;
        let waits = |peer: &Peer| peer.here && !peer.has_found_us && may_tell(peer);
        if !lock(&self.peers).by_guid.values().any(waits) {
            return;
        }
        let own = *lock(&self.own);
        let registrations = self
            .registry
            .registrations(&self.topic, !self.sends, self.sends);
        self.change(|peer| {
            let Some(registration) = registrations
                .iter()
                .find(|registration| registration.guid == peer.guid)
            else {
                return false;
            };
            if peer.info.is_none() {
                peer.fits &= fit(&registration.info.types, &self.types);
                peer.info = Some(registration.info.clone());
            }
            let changes = !peer.has_found_us && registration.found.contains(&own);
            peer.has_found_us |= changes;
            changes
        });
    }

    /// Takes the notice down.
    pub(crate) fn withdraw(&self) {
        lock(&self.peers).posted = None;
    }

    /// Whom this end has found on other machines than `host`, whether they fit or not.
    pub(crate) fn found(&self, host: &str) -> BTreeSet<Guid> {
        let peers = lock(&self.peers);
        let far =
            |peer: &&Peer| peer.here && peer.info.as_ref().is_some_and(|info| info.host != host);
        peers
            .by_guid
            .values()
            .filter(far)
            .map(|peer| peer.guid)
            .collect()
    }

    /// The other ends that are there and fit.
    pub(crate) fn here<R>(&self, each: impl FnMut(&Peer) -> Option<R>) -> Vec<R> {
        let peers = lock(&self.peers);
        let here = peers.by_guid.values().filter(|peer| peer.is_here());
        here.filter_map(each).collect()
    }

    /// Whether one of them is there and fits.
    pub(crate) fn has(&self, is_it: impl Fn(&Peer) -> bool) -> bool {
        let peers = lock(&self.peers);
        peers
            .by_guid
            .values()
            .any(|peer| peer.is_here() && is_it(peer))
    }

    /// How many other ends there are.
    pub(crate) fn count(&self) -> usize {
        self.here(|_| Some(())).len()
    }

    /// Whether this end and that one have found each other, or do not fit.
    pub(crate) fn has_met(&self, guid: &Guid) -> bool {
        let peers = lock(&self.peers);
        let peer = peers.by_guid.get(guid);
        peer.is_some_and(|peer| !peer.fits || peer.has_found_us)
    }

    /// Whether to tell of an end that does not fit: once of each, and once a second at most where there are very many.
    pub(crate) fn may_tell_of(&self, guid: &Guid) -> bool {
        let mut peers = lock(&self.peers);
        if peers.told_of.contains(guid) {
            return false;
        }
        if peers.told_of.len() == REMEMBERED {
            return self.rate_limit.allow().is_some();
        }
        peers.told_of.insert(*guid)
    }

    /// Waits until the other ends have changed, at most `limit`.
    pub(crate) fn wait(&self, limit: Duration) {
        let peers = lock(&self.peers);
        // Whether it was a change or the limit, the caller looks again.
        let _ = self.changed.wait_timeout(peers, limit);
    }

    /// Whether a sample was kept from before this end was there, and comes although it asked for nothing old.
    pub(crate) fn is_old(&self, sample: &Sample) -> bool {
        let peers = lock(&self.peers);
        let peer = peers.by_guid.get(&sample.writer);
        let is_fresh = peer.is_none_or(|peer| peer.since.elapsed() < CATCH_UP);
        // By the clock of another machine it may look so for longer.
        is_fresh && sample.stamp != 0 && sample.stamp < self.opened
    }

    /// Whether an end was found, be it gone by now.
    pub(crate) fn knows(&self, guid: &Guid) -> bool {
        lock(&self.peers).by_guid.contains_key(guid)
    }

    /// The hash of the types of whoever sent a sample, 0 of a stranger; `None` if they are not ours.
    pub(crate) fn type_hash(&self, writer: &Guid) -> Option<u64> {
        let begin = Instant::now();
        while !self.knows(writer) && begin.elapsed() < KNOWN {
            self.wait(LOOK);
        }
        let is_new = |peer: &Peer| peer.info.is_none() && peer.since.elapsed() < CATCH_UP;
        let unknown = lock(&self.peers).by_guid.get(writer).is_some_and(is_new);
        if unknown {
            self.look();
        }
        let peers = lock(&self.peers);
        match peers.by_guid.get(writer) {
            Some(peer) if !peer.fits => None,
            Some(peer) => Some(peer.info.as_ref().map_or(0, |info| info.types.hash)),
            None => Some(0),
        }
    }
}

/// The sending or receiving end of a topic of DDS.
pub(crate) enum Entity {
    Writer(Arc<Writer>),
    Reader(Arc<Reader>),
}
