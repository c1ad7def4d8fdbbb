//! What an end of ours knows of the other ends, and what it has heard.

use rc_ddsc::{End, Guid, Reader, Sample, Writer};
use rc_middleware::{TypeIdentity, WakeEvent};
use rc_network::{EndpointInfo, QosContract, RateLimit, RegistrationGuard, Role, lock};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, Condvar, Mutex, PoisonError, Weak};
use std::time::Duration;

/// How many ends that have gone are remembered, because what they sent may still be unread; and how many that do not fit,
/// because they have been told of.
const REMEMBERED: usize = 256;

/// The two kinds of ends that the library has.
pub(crate) enum Entity {
    Writer(Writer),
    Reader(Reader),
}

impl Entity {
    fn matched(&self, handle: u64) -> Option<End> {
        match self {
            Self::Writer(writer) => writer.matched(handle),
            Self::Reader(reader) => reader.matched(handle),
        }
    }

    /// Sends a body; see `Writer::write`. A reader cannot.
    pub(crate) fn write(
        &self,
        sequence: u64,
        stamp: i64,
        body: &[u8],
    ) -> Result<(), rc_ddsc::Error> {
        match self {
            Self::Writer(writer) => writer.write(sequence, stamp, body),
            Self::Reader(_) => Err(rc_ddsc::Error::BAD_PARAMETER),
        }
    }

    pub(crate) fn guid(&self) -> Result<Guid, rc_ddsc::Error> {
        match self {
            Self::Writer(writer) => writer.guid(),
            Self::Reader(reader) => reader.guid(),
        }
    }
}

/// Where a reader puts what it hears, on a thread of the library.
pub(crate) trait Inbox: Send + Sync {
    /// Keeps a sample, or does not.
    fn put(&self, sample: Sample);

    /// Whether something in it may be read now that the other ends have changed.
    fn waits(&self) -> bool {
        false
    }
}

/// What nobody sends to.
impl Inbox for () {
    fn put(&self, _sample: Sample) {}
}

/// Another end that was found.
#[derive(Clone, Debug)]
pub(crate) struct Peer {
    pub(crate) guid: Guid,
    /// The participant that it is of, its first 12 bytes.
    pub(crate) member: [u8; 12],
    /// None of a stranger.
    pub(crate) info: Option<EndpointInfo>,
    /// How long what it sends is worth anything.
    lifespan: Option<Duration>,
    /// Whether its types are the same, as far as it tells.
    pub(crate) fits: bool,
    /// Whether it is still there.
    pub(crate) here: bool,
}

/// Whom a sample is from.
pub(crate) struct Sender {
    /// It stays the same when the sender is lost and found again.
    pub(crate) id: u128,
    /// Of its types; 0 of a stranger.
    pub(crate) type_hash: u64,
    /// How long its samples are worth anything.
    pub(crate) lifespan: Option<Duration>,
}

/// What is shared between an end, the library's threads and the watcher.
pub(crate) struct EndpointState {
    /// The name of the topic in DDS.
    pub(crate) topic: String,
    pub(crate) role: Role,
    pub(crate) types: TypeIdentity,
    /// Whether it sends, or else receives.
    pub(crate) sends: bool,
    pub(crate) contract: QosContract,
    pub(crate) deadline: Option<Duration>,
    /// Rings when something was heard or the other ends have changed.
    pub(crate) signal: WakeEvent,
    inbox: Arc<dyn Inbox>,
    entity: Mutex<Attachment>,
    attached: Condvar,
    /// Serializes taking, so that samples keep their order.
    taking: Mutex<()>,
    peers: Mutex<Peers>,
    changed: Condvar,
    pub(crate) rate_limit: RateLimit,
}

/// The end that an ear belongs to.
#[derive(Default)]
enum Attachment {
    /// It is being made.
    #[default]
    Awaited,
    There(Weak<Entity>),
    Gone,
}

#[derive(Default)]
struct Peers {
    by_handle: BTreeMap<u64, Peer>,
    gone: usize,
    /// Those who do not fit and have been told of.
    told_of: BTreeSet<Guid>,
    posted: Option<RegistrationGuard>,
}

impl Peers {
    /// Writes on the notice of this end whom it has found.
    fn note(&mut self, guid: &Guid) {
        if let Some(posted) = &mut self.posted {
            let here = self.by_handle.values().filter(|peer| peer.here);
            // The notice only helps others to start; they wait for a bounded time.
            let _ = posted.found(guid, here.map(|peer| &peer.guid));
        }
    }
}

impl EndpointState {
    pub(crate) fn new(
        topic: String,
        role: Role,
        types: TypeIdentity,
        sends: bool,
        qos: &rc_ddsc::Qos<'_>,
        signal: WakeEvent,
        inbox: Arc<dyn Inbox>,
    ) -> Self {
        Self {
            topic,
            role,
            types,
            sends,
            contract: crate::qos::contract(qos),
            deadline: qos.deadline,
            signal,
            inbox,
            entity: Mutex::default(),
            attached: Condvar::new(),
            taking: Mutex::default(),
            peers: Mutex::default(),
            changed: Condvar::new(),
            rate_limit: RateLimit::default(),
        }
    }

    /// From now on the end is there.
    pub(crate) fn attach(&self, entity: &Arc<Entity>) {
        *lock(&self.entity) = Attachment::There(Arc::downgrade(entity));
        self.attached.notify_all();
        self.listen();
    }

    /// From now on nobody is given the end any more; who has it gives it up soon.
    pub(crate) fn detach(&self) {
        *lock(&self.entity) = Attachment::Gone;
        self.attached.notify_all();
    }

    /// The end, as soon as it is made.
    fn entity(&self) -> Option<Arc<Entity>> {
        let mut entity = lock(&self.entity);
        loop {
            match &*entity {
                Attachment::There(there) => return there.upgrade(),
                Attachment::Gone => return None,
                Attachment::Awaited => {
                    let waited = self.attached.wait(entity);
                    entity = waited.unwrap_or_else(PoisonError::into_inner);
                }
            }
        }
    }

    /// Puts what has come into the inbox.
    pub(crate) fn listen(&self) {
        let entity = match &*lock(&self.entity) {
            Attachment::There(there) => there.upgrade(),
            // What comes before the end is known to us is taken when it is.
            Attachment::Awaited | Attachment::Gone => None,
        };
        let Some(entity) = entity else { return };
        let Entity::Reader(reader) = &*entity else {
            return;
        };
        let _turn = lock(&self.taking);
        if matches!(reader.take(|sample| self.inbox.put(sample)), Ok(1..)) {
            self.signal.wake();
        }
    }

    fn look_up(&self, handle: u64) -> Option<Peer> {
        let end = self.entity()?.matched(handle)?;
        let info = EndpointInfo::parse(&end.user_data);
        let fits = info.as_ref().is_none_or(|info| info.types == self.types);
        let mut member = [0; 12];
        member.copy_from_slice(&end.guid[..12]);
        Some(Peer {
            guid: end.guid,
            member,
            lifespan: end.lifespan,
            info,
            fits,
            here: true,
        })
    }

    /// Another end was found. Gives it where its types differ.
    pub(crate) fn matched(&self, handle: u64) -> Option<Peer> {
        let peer = self.look_up(handle)?;
        let mut peers = lock(&self.peers);
        peers.by_handle.insert(handle, peer.clone());
        peers.note(&peer.guid);
        drop(peers);
        self.tell();
        (!peer.fits).then_some(peer)
    }

    /// It has gone.
    pub(crate) fn unmatched(&self, handle: u64) {
        let mut peers = lock(&self.peers);
        if let Some(peer) = peers.by_handle.get_mut(&handle) {
            peer.here = false;
            peers.gone += 1;
        }
        if peers.gone > REMEMBERED {
            peers.by_handle.retain(|_, peer| peer.here);
            peers.gone = 0;
        }
        drop(peers);
        self.tell();
    }

    fn tell(&self) {
        self.changed.notify_all();
        // A call that waits may wait in vain now, and a request that was held may be served.
        if self.role == Role::Client || self.inbox.waits() {
            self.signal.wake();
        }
    }

    /// The notice of this end; whom it has found already is written on it.
    pub(crate) fn post(&self, posted: RegistrationGuard) {
        let mut peers = lock(&self.peers);
        peers.posted = Some(posted);
        let found: Vec<Guid> = peers.by_handle.values().map(|peer| peer.guid).collect();
        for guid in &found {
            peers.note(guid);
        }
    }

    /// Takes the notice down.
    pub(crate) fn withdraw(&self) {
        lock(&self.peers).posted = None;
    }

    /// The other ends that are there and fit.
    pub(crate) fn here<R>(&self, each: impl FnMut(&Peer) -> Option<R>) -> Vec<R> {
        let peers = lock(&self.peers);
        let here = peers.by_handle.values().filter(|p| p.here && p.fits);
        here.filter_map(each).collect()
    }

    /// Whether one of them is there and fits.
    pub(crate) fn has(&self, is_it: impl Fn(&Peer) -> bool) -> bool {
        let peers = lock(&self.peers);
        let mut here = peers.by_handle.values().filter(|p| p.here && p.fits);
        here.any(is_it)
    }

    /// How many other ends there are.
    pub(crate) fn count(&self) -> usize {
        self.here(|_| Some(())).len()
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

    /// Whether this end has been found.
    pub(crate) fn has_found(&self, guid: &Guid) -> bool {
        let peers = lock(&self.peers);
        peers.by_handle.values().any(|peer| peer.guid == *guid)
    }

    /// Waits until the other ends have changed, at most `limit`.
    pub(crate) fn wait(&self, limit: Duration) {
        let peers = lock(&self.peers);
        // Whether it was a change or the limit, the caller looks again.
        let _ = self.changed.wait_timeout(peers, limit);
    }

    /// The sender of a sample; `None` if its types are not ours.
    pub(crate) fn sender(&self, handle: u64) -> Option<Sender> {
        let of = |peer: &Peer| {
            peer.fits.then_some(Sender {
                id: u128::from_be_bytes(peer.guid),
                type_hash: peer.info.as_ref().map_or(0, |info| info.types.hash),
                lifespan: peer.lifespan,
            })
        };
        let known = lock(&self.peers).by_handle.get(&handle).map(of);
        // The watcher may be on its way.
        let known = known.or_else(|| Some(of(&self.look_up(handle)?)));
        known.unwrap_or(Some(Sender {
            id: handle.into(),
            type_hash: 0,
            lifespan: None,
        }))
    }

    /// The participant of the sender of a sample.
    pub(crate) fn member(&self, handle: u64) -> Option<[u8; 12]> {
        let peers = lock(&self.peers);
        let known = peers.by_handle.get(&handle).map(|peer| peer.member);
        drop(peers);
        known.or_else(|| Some(self.look_up(handle)?.member))
    }
}
