//! The ages of values, and what slots count about them.
//!
//! By the clock of the system, a value is as old as the time since it was sent; in simulated time,
//! since the tick in which it came.

use crate::clock::Clock;
use rc_management::component::FreshnessStatus;
use rc_middleware::freshness::{Freshness, Made};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

/// Counts of the ages of a slot's values. Worker and management share them.
#[derive(Clone, Debug, Default)]
pub(crate) struct FreshCounts(Arc<Counts>);

#[derive(Debug, Default)]
struct Counts {
    /// `fresh` in nanoseconds; 0 without it.
    limit: AtomicU64,
    /// When the newest value was made, 0 before the first one.
    newest: AtomicU64,
    /// Values that came and that nobody used.
    unused: AtomicU64,
    /// How often a value was used, and was fresh then.
    uses: AtomicU64,
    fresh: AtomicU64,
    /// Values that were not used because they were too old.
    refused: AtomicU64,
    /// Uses of a value that was used before.
    cached: AtomicU64,
    /// Samples that waited for others of their collection, and left without them.
    unmatched: AtomicU64,
}

impl FreshCounts {
    pub(crate) fn new(limit: Option<Duration>) -> Self {
        let counts = Self::default();
        let limit = limit.map_or(0, nanoseconds);
        counts.0.limit.store(limit, Ordering::Relaxed);
        counts
    }

    /// A value came that was made at this time.
    pub(crate) fn came(&self, made: u64) {
        self.0.newest.store(made.max(1), Ordering::Relaxed);
        self.0.unused.fetch_add(1, Ordering::Relaxed);
    }

    /// The newest value was used.
    pub(crate) fn used(&self, freshness: Freshness) {
        self.0.unused.store(0, Ordering::Relaxed);
        self.0.uses.fetch_add(1, Ordering::Relaxed);
        let fresh = u64::from(freshness.is_fresh);
        self.0.fresh.fetch_add(fresh, Ordering::Relaxed);
        let cached = u64::from(freshness.made == Made::Cached);
        self.0.cached.fetch_add(cached, Ordering::Relaxed);
    }

    /// A value was too old.
    pub(crate) fn refused(&self) {
        self.0.refused.fetch_add(1, Ordering::Relaxed);
    }

    /// Samples left their collection without a match.
    pub(crate) fn left(&self, samples: u64) {
        self.0.unmatched.fetch_add(samples, Ordering::Relaxed);
    }

    /// The metrics of data freshness of Bouzeghoub and Peralta (IQIS 2004) and the timeliness of
    /// Ballou et al. (Management Science 44, 1998), whose volatility is `fresh`.
    pub(crate) fn status(&self, now: u64) -> FreshnessStatus {
        let load = |of: &AtomicU64| of.load(Ordering::Relaxed);
        let (limit, newest) = (load(&self.0.limit), load(&self.0.newest));
        let milliseconds = |ns: u64| ns as f64 / 1e6;
        let currency = (newest > 0).then(|| now.saturating_sub(newest));
        let uses = load(&self.0.uses);
        FreshnessStatus {
            fresh_ms: (limit > 0).then(|| milliseconds(limit)),
            currency_ms: currency.map(milliseconds),
            obsolescence: load(&self.0.unused),
            rate: (uses > 0).then(|| load(&self.0.fresh) as f64 / uses as f64),
            timeliness: currency
                .filter(|_| limit > 0)
                .map(|age| (1.0 - age as f64 / limit as f64).max(0.0)),
            uses,
            cached: load(&self.0.cached),
            refused: load(&self.0.refused),
            unmatched: load(&self.0.unmatched),
        }
    }
}

pub(crate) fn nanoseconds(time: Duration) -> u64 {
    u64::try_from(time.as_nanos()).unwrap_or(u64::MAX)
}

/// The present time by which ages are counted.
pub(crate) fn moment(simulated: Option<&dyn Clock>) -> u64 {
    simulated.map_or_else(rc_middleware::now, |clock| clock.now().as_nanos())
}

/// The age of a value, and whether it is fresh.
pub(crate) fn age(made: u64, now: u64, limit: Option<Duration>) -> (Duration, bool) {
    let age = Duration::from_nanos(now.saturating_sub(made));
    (age, limit.is_none_or(|limit| age <= limit))
}
