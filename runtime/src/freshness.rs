//! The newest samples of slots with `fresh`, and how old they are.
//!
//! By the clock of the system, a sample is as old as the time since it was sent; in simulated time,
//! since the tick in which it came.

use crate::clock::Clock;
use crate::collect::{Collect, Collected, Collector};
use crate::component::Body;
use crate::exact::entry::Kind;
use crate::exact::mode::Exact;
use crate::stored_sample::StoredSample;
use rc_management::component::FreshnessStatus;
use rc_middleware::freshness::{Fresh, Freshness, Made};
use rc_middleware::qos::Stale;
use rc_middleware::{CallError, DecodeError, Encoding, Header, Reader};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

/// What a slot counts about the ages of its values. Worker and management share it.
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
    fn left(&self, samples: u64) {
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

/// The newest sample of a topic.
#[derive(Debug)]
struct Newest {
    made: u64,
    sample: StoredSample,
    was_fresh: bool,
    is_used: bool,
}

/// A topic of a slot with `fresh`.
#[derive(Debug)]
struct Topic {
    at: (usize, usize),
    limit: Option<Duration>,
    stale: Stale,
    newest: Option<Newest>,
    counts: FreshCounts,
}

/// The time by which ages are counted: the monotonic clock of the system, as that of headers, or a
/// simulated one. An exact recording keeps it.
#[derive(Clone, Debug)]
pub(crate) struct Moments {
    pub(crate) exact: Exact,
    pub(crate) simulated: Option<Arc<dyn Clock>>,
}

impl Moments {
    pub(crate) fn now(&self) -> u64 {
        let now = || moment(self.simulated.as_deref());
        self.exact.number(Kind::Moment, now)
    }

    /// When a sample was made: when it was sent, or came in simulated time.
    pub(crate) fn of(&self, header: &Header) -> u64 {
        self.exact.number(Kind::Moment, || match header.sent {
            sent if sent > 0 && self.simulated.is_none() => sent,
            _ => moment(self.simulated.as_deref()),
        })
    }
}

/// The newest samples of a component, and those that wait to be collected.
#[derive(Debug, Default)]
pub(crate) struct Inputs {
    topics: Vec<Topic>,
    collectors: Vec<Collector>,
    /// The latest time that it has seen.
    seen: u64,
}

/// What a component does with a sample that came.
pub(crate) struct Arrival {
    pub(crate) freshness: Freshness,
    /// Whether its handler runs.
    pub(crate) is_handled: bool,
    /// What the slot counts, if it is the first sample of a topic.
    pub(crate) new: Option<FreshCounts>,
}

/// A topic, and what its slot says of ages.
#[derive(Clone, Copy)]
pub(crate) struct Limits {
    pub(crate) topic: (usize, usize),
    pub(crate) fresh: Option<Duration>,
    pub(crate) stale: Stale,
}

impl Inputs {
    /// Forgets all samples if time was set back: they are of another time, and would count as fresh
    /// until it comes again.
    fn see(&mut self, now: u64) {
        if now < self.seen {
            self.topics.iter_mut().for_each(|topic| topic.newest = None);
            self.collectors.iter_mut().for_each(Collector::clear);
        }
        self.seen = now;
    }

    /// Keeps a sample of a topic that was made at `made`, and came at `now`.
    pub(crate) fn arrive(
        &mut self,
        limits: Limits,
        (made, now): (u64, u64),
        encoding: Encoding,
        body: &Body<'_>,
    ) -> Arrival {
        self.see(now);
        let Limits {
            topic: at,
            fresh,
            stale,
        } = limits;
        let (age, is_fresh) = age(made, now, fresh);
        let freshness = Freshness {
            age,
            made: Made::Computed,
            is_fresh,
        };
        let mut new = None;
        let place = self.topics.iter().position(|topic| topic.at == at);
        let place = place.unwrap_or_else(|| {
            // Topics of one slot count together.
            let same = self.topics.iter().find(|topic| topic.at.0 == at.0);
            let counts = same.map(|topic| topic.counts.clone());
            let counts = counts.unwrap_or_else(|| {
                let counts = FreshCounts::new(fresh);
                new = Some(counts.clone());
                counts
            });
            self.topics.push(Topic {
                at,
                limit: fresh,
                stale,
                newest: None,
                counts,
            });
            self.topics.len() - 1
        });
        let topic = &mut self.topics[place];
        topic.counts.came(made);
        let is_handled = is_fresh || stale == Stale::Inform;
        if !is_handled {
            topic.counts.refused();
        }
        let last_was_fresh = topic.newest.as_ref().is_some_and(|last| last.was_fresh);
        let keeps_last = stale == Stale::Last && !is_fresh && last_was_fresh;
        if !keeps_last {
            let last = topic.newest.take().map(|last| last.sample);
            topic.newest = Some(Newest {
                made,
                sample: StoredSample::of(encoding, body, last),
                was_fresh: is_fresh,
                is_used: false,
            });
        }
        Arrival {
            freshness,
            is_handled,
            new,
        }
    }

    /// The handler of the newest sample of a topic begins.
    pub(crate) fn handled(&mut self, at: (usize, usize), freshness: Freshness) {
        if let Some(topic) = self.topics.iter_mut().find(|topic| topic.at == at) {
            topic.counts.used(freshness);
        }
    }

    /// The newest sample of a topic, which `read` reads.
    pub(crate) fn newest<T>(
        &mut self,
        at: (usize, usize),
        now: u64,
        read: impl FnOnce(&mut Reader<'_>) -> Result<T, DecodeError>,
    ) -> Result<Fresh<T>, CallError> {
        self.see(now);
        let topic = self.topics.iter_mut().find(|topic| topic.at == at);
        let topic = topic.ok_or(CallError::NoValue)?;
        let newest = topic.newest.as_mut().ok_or(CallError::NoValue)?;
        let (age, is_fresh) = age(newest.made, now, topic.limit);
        if !is_fresh && topic.stale == Stale::Refuse {
            topic.counts.refused();
            return Err(CallError::Stale { age });
        }
        let made = if std::mem::replace(&mut newest.is_used, true) {
            Made::Cached
        } else {
            Made::Computed
        };
        let freshness = Freshness {
            age,
            made,
            is_fresh,
        };
        topic.counts.used(freshness);
        Ok(Fresh::new(newest.sample.read(read)?, freshness))
    }

    /// Adds a sample to a collection. Returns what its handler gets together.
    pub(crate) fn collect(
        &mut self,
        collects: &[Collect],
        (number, topic): (usize, usize),
        depth: u32,
        (sample, now): (Collected, u64),
    ) -> Option<Vec<Collected>> {
        while self.collectors.len() < collects.len() {
            let collect = &collects[self.collectors.len()];
            let collector = Collector::new(collect.within, collect.topics.len());
            self.collectors.push(collector);
        }
        let collector = &mut self.collectors[number];
        collector.set_depth(topic, depth as usize);
        collector.expire(now);
        let all = collector.add(topic, sample);
        for (dropped, at) in std::iter::zip(&mut collector.dropped, collects[number].topics) {
            let dropped = std::mem::take(dropped);
            if let Some(topic) = self.topics.iter().find(|topic| topic.at == *at) {
                topic.counts.left(dropped);
            }
        }
        let mut all = all?;
        // The other ones have become older while they waited.
        for waited in &mut all {
            let (age, is_fresh) = age(waited.at, now, waited.limit);
            waited.freshness.age = age;
            waited.freshness.is_fresh = is_fresh;
        }
        Some(all)
    }
}

#[cfg(test)]
mod tests;
