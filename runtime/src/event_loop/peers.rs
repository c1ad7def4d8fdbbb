//! How many peers each slot has.

use super::network_time::stamp;
use super::{EventLoop, PEERS_INTERVAL};
use crate::ports::Receiver;
use std::time::Instant;

impl EventLoop<'_> {
    /// Counts the peers of all slots, once in their interval.
    pub(super) fn update_peers(&mut self, now: Instant) {
        if self
            .peers_at
            .is_some_and(|last| now.saturating_duration_since(last) < PEERS_INTERVAL)
        {
            return;
        }
        self.peers_at = Some(now);
        let counts = self.count_peers(now);
        let mismatches = self.connections.mismatches();
        let mut status = self.shared.status();
        for (slot, peers) in status.slots.iter_mut().zip(counts) {
            slot.peers = peers;
        }
        status.note_mismatches(&mismatches);
    }

    /// Counts the peers of each slot, and begins the deadline of topics that have a publisher.
    pub(super) fn count_peers(&mut self, now: Instant) -> Vec<usize> {
        let here = stamp(&self.role, self.began, now);
        let mut counts = vec![0; self.connections.slots().len()];
        for port in &mut self.ports {
            counts[port.slot] = match &port.receiver {
                // A server listens on each middleware.
                Receiver::Server { port: server, .. } => counts[port.slot] + server.peers(),
                Receiver::Subscriber {
                    port: subscriber, ..
                } => {
                    let peers = subscriber.peers();
                    if peers > 0 {
                        port.last_sample.get_or_insert(here);
                    }
                    peers.max(counts[port.slot])
                }
            };
        }
        self.component.sending_peers(&mut counts);
        counts
    }
}
