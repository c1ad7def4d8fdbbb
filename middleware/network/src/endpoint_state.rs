//! The state of one endpoint of this component: its identity, its quality of service and its peers.
//! The component, the threads of the library and the thread of discovery share it.

use crate::peers::{PeerTable, REMEMBERED};
use crate::{Guid, Identity, Peer, Presence, RateLimit, RegistrationGuard, Role, lock};
use rc_middleware::WakeEvent;
use std::sync::{Arc, Condvar, Mutex};
use std::time::Duration;

/// Samples that an endpoint has received and that were not taken yet.
pub trait Backlog: Send + Sync {
    /// Whether something in it waits for a change of the peers.
    fn awaits_peers(&self) -> bool {
        false
    }
}

/// The backlog of a writer.
impl Backlog for () {}

/// The state of one endpoint. The library names peers by handles.
pub struct EndpointState {
    /// Identity of the endpoint.
    pub identity: Identity,
    /// Wakes the owner of the endpoint when a sample arrives, or when peers change and the owner
    /// waits for that.
    pub signal: WakeEvent,
    /// Limits reports about this endpoint.
    pub report_limit: RateLimit,
    backlog: Arc<dyn Backlog>,
    table: Mutex<PeerTable>,
    changed: Condvar,
}

impl EndpointState {
    /// The state of a new endpoint without peers.
    pub fn new(identity: Identity, signal: WakeEvent, backlog: Arc<dyn Backlog>) -> Self {
        Self {
            identity,
            signal,
            report_limit: RateLimit::default(),
            backlog,
            table: Mutex::default(),
            changed: Condvar::new(),
        }
    }

    /// The name of its topic in DDS.
    pub fn topic(&self) -> &str {
        &self.identity.topic
    }

    /// Adds a peer that was discovered.
    pub(crate) fn insert(&self, key: u64, peer: Peer) {
        lock(&self.table).insert(key, peer);
        self.notify();
    }

    /// Marks the peer `key` as left. Its samples that are still unread keep their sender.
    pub(crate) fn remove(&self, key: u64) {
        if let Some(peer) = lock(&self.table).peers.get_mut(&key) {
            peer.presence = Presence::Gone;
        }
        self.notify();
    }

    fn notify(&self) {
        self.changed.notify_all();
        // The server of a waiting call may have left, and a held request may be served now.
        if self.identity.info.role == Role::Client || self.backlog.awaits_peers() {
            self.signal.wake();
        }
    }

    /// Result of `read` for the peer `key`, also after it has left.
    pub fn with<R>(&self, key: u64, read: impl FnOnce(&Peer) -> R) -> Option<R> {
        lock(&self.table).peers.get(&key).map(read)
    }

    /// Results of `read` for the usable peers.
    pub fn usable<R>(&self, read: impl FnMut(&Peer) -> Option<R>) -> Vec<R> {
        let table = lock(&self.table);
        let usable = table.peers.values().filter(|peer| peer.is_usable());
        usable.filter_map(read).collect()
    }

    /// Whether `condition` holds for a usable peer.
    pub fn has(&self, condition: impl Fn(&Peer) -> bool) -> bool {
        let table = lock(&self.table);
        let mut usable = table.peers.values().filter(|peer| peer.is_usable());
        usable.any(condition)
    }

    /// Whether `condition` holds for a peer, be it unusable.
    pub(crate) fn any(&self, condition: impl Fn(&Peer) -> bool) -> bool {
        lock(&self.table).peers.values().any(condition)
    }

    /// The number of usable peers.
    pub fn count(&self) -> usize {
        self.usable(|_| Some(())).len()
    }

    /// Whether to report a mismatched endpoint: each one once, and at most one a second where there
    /// are very many.
    pub(crate) fn should_report(&self, guid: &Guid) -> bool {
        let mut table = lock(&self.table);
        if table.reported.contains(guid) {
            return false;
        }
        if table.reported.len() == REMEMBERED {
            return self.report_limit.allow().is_some();
        }
        table.reported.insert(*guid)
    }

    /// Waits until peers change, at most `limit`. It may return early: the caller looks again.
    pub fn wait_for_change(&self, limit: Duration) {
        let table = lock(&self.table);
        let _ = self.changed.wait_timeout(table, limit);
    }

    /// Sets the registration of this endpoint on this machine.
    pub(crate) fn register(&self, registration: RegistrationGuard) {
        lock(&self.table).register(registration);
    }

    /// Removes the registration.
    pub(crate) fn unregister(&self) {
        let registration = lock(&self.table).registration.take();
        // This may wait for a component that opens endpoints; discovery continues meanwhile.
        drop(registration);
    }

    /// The identity of this endpoint, while it is registered.
    pub(crate) fn guid(&self) -> Option<Guid> {
        let table = lock(&self.table);
        table.registration.as_ref().map(RegistrationGuard::guid)
    }
}
