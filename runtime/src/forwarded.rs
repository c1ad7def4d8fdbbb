//! Counts of a forwarding component for a slot: how many messages it has forwarded, and how long
//! each of them took.

use rc_management::component::ForwardedStatus;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

/// The count and the times of the messages that a slot has forwarded. Clones share them.
#[derive(Clone, Debug, Default)]
pub struct ForwardCounts(Arc<Counts>);

#[derive(Debug, Default)]
struct Counts {
    messages: AtomicU64,
    total_ns: AtomicU64,
    most_ns: AtomicU64,
}

impl ForwardCounts {
    /// Notes a message that took so long from receiving to sending.
    pub fn note(&self, took: Duration) {
        let took = u64::try_from(took.as_nanos()).unwrap_or(u64::MAX);
        self.0.messages.fetch_add(1, Ordering::Relaxed);
        self.0.total_ns.fetch_add(took, Ordering::Relaxed);
        self.0.most_ns.fetch_max(took, Ordering::Relaxed);
    }

    pub(crate) fn status(&self) -> ForwardedStatus {
        let messages = self.0.messages.load(Ordering::Relaxed);
        let micros = |nanos: f64| (nanos / 100.0).round() / 10.0;
        let total = self.0.total_ns.load(Ordering::Relaxed) as f64;
        ForwardedStatus {
            messages,
            mean_us: micros(total / messages.max(1) as f64),
            most_us: micros(self.0.most_ns.load(Ordering::Relaxed) as f64),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mean_and_the_longest_time_are_in_microseconds() {
        let counts = ForwardCounts::default();
        assert_eq!(counts.status(), ForwardedStatus::default());
        counts.note(Duration::from_micros(10));
        counts.clone().note(Duration::from_nanos(30_260));
        let status = counts.status();
        assert_eq!(
            (status.messages, status.mean_us, status.most_us),
            (2, 20.1, 30.3)
        );
    }
}
