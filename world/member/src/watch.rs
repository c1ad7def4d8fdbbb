//! Tells the supervisor how the replica is.

use rc_runtime::{WorldReport, WorldStatus};
use rc_world::World;
use std::collections::BTreeSet;
use std::time::Duration;

/// How often it is told.
const PERIOD: Duration = Duration::from_millis(500);
/// How many names are told.
const MOST_NAMES: usize = 32;

/// Looks at a replica, and tells the supervisor.
pub(crate) struct Watch {
    report: WorldReport,
    next: Duration,
    behind_since: Option<Duration>,
    /// The instances that took part and have not said goodbye.
    known: BTreeSet<String>,
}

impl Watch {
    pub(crate) fn new(report: WorldReport) -> Self {
        Self {
            report,
            next: Duration::ZERO,
            behind_since: None,
            known: BTreeSet::new(),
        }
    }

    /// Looks at the replica if it is time to: the replica itself is due once a second at least.
    pub(crate) fn look(&mut self, world: &World, now: Duration) {
        if now < self.next {
            return;
        }
        self.next = now.saturating_add(PERIOD);
        let health = world.health();
        let since = match (health.behind, self.behind_since) {
            (0, _) => None,
            (_, None) => Some(now),
            (_, since) => since,
        };
        self.behind_since = since;
        self.known.retain(|name| !health.left.contains(name));
        self.known.extend(health.live.iter().cloned());
        let silent = self.known.difference(&health.live);
        self.report.set(WorldStatus {
            behind: health.behind,
            behind_ms: since.map_or(0, |since| now.saturating_sub(since).as_millis() as u64),
            conflicts: health.conflicts as u64,
            first_conflicts: health.first_conflicts,
            fault: health.fault,
            refused: health.refused,
            last_refusal: health.last_refusal,
            silent: silent.take(MOST_NAMES).cloned().collect(),
        });
    }
}
