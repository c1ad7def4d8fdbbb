//! The peers of one endpoint: identity, liveliness, and whether their types match.

use crate::{EndpointInfo, Guid, RegistrationGuard, Role};
use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

/// Number of peers that are remembered after they have left, because their samples may still be
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
    /// It has left, or its process has shown no sign of life for longer than its lease.
    Gone,
}

/// An endpoint that this one has discovered.
#[derive(Clone, Debug)]
pub struct Peer {
    /// GUID of the peer.
    pub guid: Guid,
    /// Announcement; `None` for an endpoint of another program.
    pub info: Option<EndpointInfo>,
    /// Whether its types match, as far as it announces them.
    pub matches: bool,
    /// Whether it can be reached.
    pub presence: Presence,
    /// How long its samples are valid; `None` for no limit.
    pub lifespan: Option<Duration>,
}

impl Peer {
    /// The participant that it belongs to.
    pub fn prefix(&self) -> GuidPrefix {
        prefix(&self.guid)
    }

    /// Whether it belongs to another program, which does not describe itself.
    pub fn is_external(&self) -> bool {
        self.info.is_none()
    }

    /// Whether it belongs to a tool, for which no component waits.
    pub fn is_observer(&self) -> bool {
        let role = self.info.as_ref().map(|info| info.role);
        role == Some(Role::Observer)
    }

    /// Whether it is present, its types match, and it belongs to no tool.
    pub fn is_usable(&self) -> bool {
        self.matches && self.presence == Presence::Present && !self.is_observer()
    }
}

/// The peers of one endpoint, by the handle under which the library names them.
#[derive(Debug, Default)]
pub(crate) struct PeerTable {
    pub(crate) peers: BTreeMap<u64, Peer>,
    /// Mismatched endpoints that were reported.
    pub(crate) reported: BTreeSet<Guid>,
    pub(crate) registration: Option<RegistrationGuard>,
}

impl PeerTable {
    pub(crate) fn insert(&mut self, key: u64, peer: Peer) {
        let guid = peer.guid;
        self.peers.insert(key, peer);
        self.note(&guid);
        let gone = |peer: &Peer| peer.presence == Presence::Gone;
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
            let gone = |peer: &&Peer| peer.presence != Presence::Gone;
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
        for number in 0..2000_u64 {
            let peer = Peer {
                guid: u128::from(number).to_be_bytes(),
                info: None,
                matches: true,
                presence: Presence::Present,
                lifespan: None,
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
