//! The report of a replica to a tool.

use crate::core::Core;
use crate::counts::Counts;
use crate::digest;
use std::time::Duration;

/// Another replica.
#[derive(Clone, Debug, PartialEq)]
pub struct PeerStatus {
    /// Its writer.
    pub writer: u64,
    /// Name of the instance.
    pub name: String,
    /// How many changes it had not seen at its last announcement.
    pub lag: u64,
    /// How long ago it was last heard.
    pub silent: Duration,
    /// Its digest at its last announcement.
    pub digest: u64,
    /// How many elements it had.
    pub elements: u64,
    /// How many conflicts it had.
    pub conflicts: u32,
    /// Whether others wait for it.
    pub is_live: bool,
    /// Whether it has said goodbye.
    pub has_left: bool,
    /// Whether its schema is another one.
    pub has_other_schema: bool,
}

/// State of a replica.
#[derive(Clone, Debug, PartialEq)]
pub struct Status {
    /// Name of the instance.
    pub name: String,
    /// Its writer.
    pub writer: u64,
    /// One number for all that it has: replicas with equal digests are equal.
    pub digest: u64,
    /// One number for the newest values of streams.
    pub streams: u64,
    /// How many changes of all writers it has seen.
    pub changes: u64,
    /// How many elements it has.
    pub elements: u64,
    /// How many of them are not shown.
    pub conflicts: u32,
    /// How many removals it remembers.
    pub tombstones: usize,
    /// How many values of streams it holds.
    pub held_streams: usize,
    /// How many bytes wait to be sent.
    pub queued: usize,
    /// How many bytes of changes wait for earlier ones of their writers.
    pub waiting: usize,
    /// Whether it lacks something that others have.
    pub is_behind: bool,
    /// Why the newest changes are not shown.
    pub fault: Option<String>,
    /// Its counts.
    pub counts: Counts,
    /// The other replicas.
    pub peers: Vec<PeerStatus>,
}

impl Status {
    pub(crate) fn of(core: &mut Core, now: Duration) -> Self {
        let digest = digest::one(&core.protocol.digests.of(&core.replica));
        let protocol = &core.protocol;
        let seen = core.replica.seen();
        let peers = protocol.peers.all.iter().map(|(writer, peer)| PeerStatus {
            writer: *writer,
            name: peer.name.clone(),
            lag: peer.lag(seen),
            silent: now.saturating_sub(peer.heard),
            digest: peer.digest(),
            elements: peer.elements,
            conflicts: peer.conflicts,
            is_live: peer.is_live(),
            has_left: peer.is_leaving,
            has_other_schema: peer.differs,
        });
        Self {
            name: protocol.name.clone(),
            writer: core.replica.writer(),
            digest,
            streams: core.streams.digest(),
            changes: seen
                .values()
                .fold(0, |sum, count| sum.saturating_add(*count)),
            elements: core.replica.element_count() as u64,
            conflicts: core.conflicts.len() as u32,
            tombstones: core.replica.tombstones(),
            held_streams: core.streams.len(),
            queued: protocol.outbox_bytes,
            waiting: protocol.gaps.bytes(),
            is_behind: core.lacks() || protocol.gaps.bytes() > 0,
            fault: core.fault.clone(),
            counts: protocol.counts.clone(),
            peers: peers.collect(),
        }
    }
}
