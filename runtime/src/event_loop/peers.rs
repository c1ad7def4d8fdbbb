//! The number of peers of each slot.

use super::port::Port;
use crate::clock::Time;
use crate::component::Component;
use crate::ports::{Connections, Receiver};
use crate::status::Shared;
use std::time::{Duration, Instant};

/// The interval at which the loop counts peers.
const INTERVAL: Duration = Duration::from_secs(1);

/// When peers were last counted.
#[derive(Debug, Default)]
pub(super) struct PeerInterval(Option<Instant>);

impl PeerInterval {
    /// Whether peers are to be counted now, once in their interval.
    pub(super) fn are_due(&mut self, now: Instant) -> bool {
        let since = self.0.map(|last| now.saturating_duration_since(last));
        let are_due = since.is_none_or(|since| since >= INTERVAL);
        if are_due {
            self.0 = Some(now);
        }
        are_due
    }
}

/// Updates the status with the number of peers of each slot, and with peers that do not match.
pub(super) fn note(counts: Vec<usize>, connections: &Connections, shared: &Shared) {
    let mismatches = connections.mismatches();
    let mut status = shared.status();
    for (slot, peers) in status.slots.iter_mut().zip(counts) {
        slot.peers = peers;
    }
    status.note_mismatches(&mismatches);
}

/// Counts the peers of each slot, and begins the deadline of topics that have a publisher: `here` is
/// the time now, as a `stamp`.
pub(super) fn count(
    ports: &mut [Port],
    component: &dyn Component,
    slots: usize,
    here: Time,
) -> Vec<usize> {
    let mut counts = vec![0; slots];
    for port in ports {
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
    component.sending_peers(&mut counts);
    counts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn peers_are_counted_once_in_their_interval() {
        let now = Instant::now();
        let mut interval = PeerInterval::default();
        let due = [0, 500, 1000, 1500, 2000]
            .map(|after| interval.are_due(now + Duration::from_millis(after)));
        assert_eq!(due, [true, false, true, false, true]);
    }
}
