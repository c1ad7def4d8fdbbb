//! The newest samples of slots with `fresh`, and how old they are.

use crate::ages::{FreshCounts, age, moment};
use crate::clock::Clock;
use crate::collect::{Collect, Collected, Collector};
use crate::component::Body;
use crate::exact::entry::Kind;
use crate::exact::mode::Exact;
use crate::stored_sample::StoredSample;
use rc_middleware::freshness::{Fresh, Freshness, Made};
use rc_middleware::qos::Stale;
use rc_middleware::{CallError, DecodeError, Encoding, Header, Reader};
use std::sync::Arc;
use std::time::Duration;

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

/// Treatment of a sample that has arrived.
pub(crate) struct Arrival {
    pub(crate) freshness: Freshness,
    /// Whether its handler runs.
    pub(crate) is_handled: bool,
    /// Counts of the slot, if it is the first sample of a topic.
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
