//! Watches a replica for its supervisor.

use crate::health::Health;
use crate::world::World;
use std::collections::BTreeSet;
use std::time::Duration;

/// How often it looks.
const PERIOD: Duration = Duration::from_millis(500);
/// How many names are listed.
const MOST_NAMES: usize = 32;
/// How many silent instances are remembered: a sender may invent names.
const MOST_SILENT: usize = 1024;

/// Looks at a replica twice a second.
#[derive(Debug, Default)]
pub struct Watch {
    next: Duration,
    behind_since: Option<Duration>,
    /// The instances that took part and have not said goodbye.
    known: BTreeSet<String>,
}

/// The state of a [`Watch`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Seen {
    /// The problems of the replica.
    pub health: Health,
    /// For how long it has lacked changes.
    pub behind_for: Duration,
    /// Instances that are silent and have not said goodbye, some of them if there are many.
    pub silent: Vec<String>,
    /// How many more there are.
    pub more_silent: usize,
}

impl Watch {
    /// Looks at the replica if it is time to. The replica itself is due once a second at least.
    pub fn look(&mut self, world: &World, now: Duration) -> Option<Seen> {
        if now < self.next {
            return None;
        }
        self.next = now.saturating_add(PERIOD);
        let health = world.health();
        self.behind_since = match (health.behind, self.behind_since) {
            (0, _) => None,
            (_, since) => Some(since.unwrap_or(now)),
        };
        self.known.retain(|name| !health.left.contains(name));
        self.known.extend(health.live.iter().cloned());
        if self.known.len() > health.live.len().saturating_add(MOST_SILENT) {
            self.known.clone_from(&health.live);
        }
        let mut all = self.known.difference(&health.live);
        let silent = all.by_ref().take(MOST_NAMES).cloned().collect();
        let more_silent = all.count();
        let since = self.behind_since.unwrap_or(now);
        Some(Seen {
            health,
            behind_for: now.saturating_sub(since),
            silent,
            more_silent,
        })
    }
}
