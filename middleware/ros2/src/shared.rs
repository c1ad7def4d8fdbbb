//! What the thread that listens and the component share: the endpoints of this component, and what
//! other components have told of theirs.

use crate::endpoint_state::EndpointState;
use crate::presence::Told;
use rc_network::{EndpointInfo, Guid, GuidPrefix, Mismatches, lock, prefix};
use rustdds::mio1::Waker;
use std::collections::{BTreeMap, HashMap};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, OnceLock};
use std::time::{Duration, Instant};

/// An end of this component.
pub(crate) struct Own {
    pub(crate) guid: Guid,
    pub(crate) state: Arc<EndpointState>,
}

/// What the thread and the component share.
pub(crate) struct Shared {
    pub(crate) host: String,
    pub(crate) ends: Mutex<BTreeMap<usize, Own>>,
    pub(crate) members: Mutex<HashMap<GuidPrefix, Other>>,
    pub(crate) waker: Arc<Waker>,
    pub(crate) next: AtomicUsize,
    /// Ends of ours and of others that have found each other before ours was known here.
    pub(crate) early: Mutex<Vec<Early>>,
    /// Whether ends have come or gone, of which others and ROS have to be told.
    pub(crate) is_new: AtomicBool,
    /// Whether ends have found others.
    pub(crate) has_found: AtomicBool,
    /// Whether registrations of this machine are to be searched for peers.
    pub(crate) searches: AtomicBool,
    pub(crate) stops: AtomicBool,
    pub(crate) mismatches: Mismatches,
    /// Why the library works no more.
    pub(crate) lost: OnceLock<String>,
}

/// An end of ours and one of others that have found each other, and when.
pub(crate) struct Early {
    pub(crate) own: Guid,
    pub(crate) other: Guid,
    pub(crate) since: Instant,
}

/// Another component of ours, or this one.
pub(crate) struct Other {
    pub(crate) ends: BTreeMap<Guid, Told>,
    /// By which it says that it lives.
    pub(crate) lease: Duration,
    pub(crate) heard: Instant,
    pub(crate) silent: bool,
}

impl Shared {
    /// A number for a new end.
    pub(crate) fn number(&self) -> usize {
        self.next.fetch_add(1, Ordering::Relaxed)
    }

    /// An end is there.
    pub(crate) fn opened(&self, number: usize, guid: Guid, state: &Arc<EndpointState>) {
        let state = Arc::clone(state);
        lock(&self.ends).insert(number, Own { guid, state });
    }

    /// An end goes.
    pub(crate) fn closed(&self, number: usize) {
        lock(&self.ends).remove(&number);
    }

    /// Others are told of the ends as they are now.
    pub(crate) fn changed(&self) {
        self.is_new.store(true, Ordering::SeqCst);
        // A thread that cannot be woken looks at its next beat.
        let _ = self.waker.wake();
    }

    /// Has the thread that listens search the registrations of this machine for peers.
    pub(crate) fn search_soon(&self) {
        self.searches.store(true, Ordering::SeqCst);
        let _ = self.waker.wake();
    }

    pub(crate) fn stop(&self) {
        self.stops.store(true, Ordering::SeqCst);
        let _ = self.waker.wake();
    }

    /// Who has told of an end at `topic`, of other processes on other machines.
    pub(crate) fn told_at(&self, topic: &str, own: GuidPrefix, host: &str) -> Vec<EndpointInfo> {
        let members = lock(&self.members);
        let others = members
            .iter()
            .filter(|(member, other)| **member != own && !other.silent);
        let ends = others.flat_map(|(_, other)| other.ends.values());
        let there = ends.filter(|told| told.topic == topic && told.info.host != host);
        there.map(|told| told.info.clone()).collect()
    }

    /// Who has sent something: the connection of a component of ours, or the writer of a stranger.
    pub(crate) fn sender(&self, writer: &Guid) -> Guid {
        let members = lock(&self.members);
        let other = members.get(&prefix(writer));
        match other.and_then(|other| other.ends.get(writer)) {
            Some(told) => {
                let mut sender = *writer;
                sender[12..].copy_from_slice(&told.connection.to_be_bytes());
                sender
            }
            None => *writer,
        }
    }

    pub(crate) fn all(&self) -> Vec<Arc<EndpointState>> {
        let ends = lock(&self.ends);
        ends.values().map(|own| Arc::clone(&own.state)).collect()
    }

    /// The end with this identity.
    pub(crate) fn by_guid(&self, guid: &Guid) -> Option<Arc<EndpointState>> {
        let ends = lock(&self.ends);
        let own = ends.values().find(|own| own.guid == *guid)?;
        Some(Arc::clone(&own.state))
    }

    /// Whether the process of another end is silent.
    pub(crate) fn is_silent(&self, other: &Guid) -> bool {
        let members = lock(&self.members);
        members
            .get(&prefix(other))
            .is_some_and(|other| other.silent)
    }

    /// What another end has told of itself to one of ours: who it is, and whether it has found it.
    pub(crate) fn told(&self, other: &Guid, own: &Guid) -> Option<(EndpointInfo, bool)> {
        let members = lock(&self.members);
        let told = members.get(&prefix(other))?.ends.get(other)?;
        Some((told.info.clone(), told.found.contains(own)))
    }
}
