//! The peers of one endpoint: identity, liveliness, and whether their types match.

use crate::{EndpointInfo, Guid, RegistrationGuard};
use std::collections::{BTreeMap, BTreeSet};

/// Number of peers that are remembered after they have gone, because their samples may still be
/// unread; and number of mismatched endpoints that are remembered, because each is reported once.
pub(crate) const REMEMBERED: usize = 256;

/// The identity of a participant, with which the identities of all its endpoints begin (RTPS 2.5,
/// 9.3.1).
pub type GuidPrefix = [u8; 12];

/// The participant of an endpoint.
pub fn prefix(guid: &Guid) -> GuidPrefix {
    let mut prefix = [0; 12];
    prefix.copy_from_slice(&guid[..12]);
    prefix
}

/// Whether a peer can be reached.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Presence {
    /// It is there.
    Present,
    /// Its process has shown no sign of life for longer than its lease.
    Silent,
    /// It has left, or its process has.
    Gone,
}

/// An endpoint that this one has discovered. `D` is what a backend knows of it besides.
#[derive(Clone, Debug)]
pub struct Peer<D> {
    /// Its identity.
    pub guid: Guid,
    /// What it tells of itself; `None` for an endpoint of another program.
    pub info: Option<EndpointInfo>,
    /// Whether its types match, as far as it tells.
    pub matches: bool,
    /// Whether it can be reached.
    pub presence: Presence,
    /// What the backend knows of it.
    pub details: D,
}

impl<D> Peer<D> {
    /// The participant that it belongs to.
    pub fn prefix(&self) -> GuidPrefix {
        prefix(&self.guid)
    }

    /// Whether it is present and its types match.
    pub fn is_usable(&self) -> bool {
        self.matches && self.presence == Presence::Present
    }
}

/// The peers of one endpoint, by the key `K` under which its library names them.
#[derive(Debug)]
pub(crate) struct PeerTable<K, D> {
    pub(crate) peers: BTreeMap<K, Peer<D>>,
    /// Mismatched endpoints that were reported.
    pub(crate) reported: BTreeSet<Guid>,
    pub(crate) registration: Option<RegistrationGuard>,
}

impl<K, D> Default for PeerTable<K, D> {
    fn default() -> Self {
        Self {
            peers: BTreeMap::new(),
            reported: BTreeSet::new(),
            registration: None,
        }
    }
}

impl<K: Ord, D> PeerTable<K, D> {
    pub(crate) fn insert(&mut self, key: K, peer: Peer<D>) {
        let guid = peer.guid;
        self.peers.insert(key, peer);
        self.note(&guid);
        let gone = |peer: &Peer<D>| peer.presence == Presence::Gone;
        if self.peers.values().filter(|peer| gone(peer)).count() > REMEMBERED {
            self.peers.retain(|_, peer| !gone(peer));
        }
    }

    /// Sets the registration of this endpoint and writes the discovered peers into it.
    pub(crate) fn register(&mut self, registration: RegistrationGuard) {
        self.registration = Some(registration);
        let found: Vec<Guid> = self.peers.values().map(|peer| peer.guid).collect();
        for guid in &found {
            self.note(guid);
        }
    }

    /// Writes the discovered peers into the registration of this endpoint.
    fn note(&mut self, guid: &Guid) {
        if let Some(registration) = &mut self.registration {
            let gone = |peer: &&Peer<D>| peer.presence != Presence::Gone;
            let here = self.peers.values().filter(gone);
            // The registration only shortens the start of other endpoints, and they wait for a
            // bounded time.
            let _ = registration.add_found(guid, here.map(|peer| &peer.guid));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn absent_peers_are_forgotten() {
        let mut table = PeerTable::default();
        for number in 0..2000_u128 {
            let peer = Peer {
                guid: number.to_be_bytes(),
                info: None,
                matches: true,
                presence: Presence::Present,
                details: (),
            };
            table.insert(number, peer);
            if number >= 10 {
                let last = table.peers.get_mut(&number).expect("the peer");
                last.presence = Presence::Gone;
            }
        }
        assert!(table.peers.len() <= REMEMBERED + 10 + 1);
        assert!((0..10).all(|number| table.peers.contains_key(&number)));
    }
}
