//! Samples of several topics that one handler gets together.
//!
//! The policy is that of `message_filters.ApproximateTimeSynchronizer` of ROS in Python: a sample is
//! matched when it comes, at once, with the nearest samples of all other topics, if the first and the
//! last of them are no further apart than `within`. Each sample is used once. A queue keeps the newest
//! samples, in number and in bytes.

use crate::ages::age;
use crate::stored_sample::StoredSample;
use rc_middleware::freshness::{Fresh, Freshness};
use rc_middleware::{DecodeError, Reader};
use std::collections::VecDeque;
use std::time::Duration;

/// The most samples that a queue keeps.
const MOST_SAMPLES: usize = 100;
/// A sample that is so much older than all that wait, in nanoseconds, comes from a clock that was set
/// back: those would stay, and each newer one would leave as the oldest.
const SET_BACK: u64 = 1_000_000_000;
/// The most bytes that the queues of one collection keep.
const MOST_BYTES: usize = 64 * 1024 * 1024;

/// Samples that one handler gets together, as the `.cdsl` lists them.
#[derive(Debug)]
pub struct Collect {
    /// The name after `as`.
    pub name: &'static str,
    /// The topics, each as the numbers of its slot and of its operation.
    pub topics: &'static [(usize, usize)],
    /// The most time between the first and the last sample.
    pub within: Duration,
}

/// A sample that waits for others, or was matched with them.
#[derive(Clone, Debug)]
pub struct Collected {
    /// When it was sent, or when it came in simulated time, in nanoseconds.
    pub(crate) at: u64,
    /// `fresh` of its slot.
    pub(crate) limit: Option<Duration>,
    /// Whether its slot has `stale refuse`.
    pub(crate) refuses: bool,
    pub(crate) freshness: Freshness,
    pub(crate) sample: StoredSample,
}

impl Collected {
    /// The value, which `read` reads, with its age.
    pub fn read<T>(
        &self,
        read: impl FnOnce(&mut Reader<'_>) -> Result<T, DecodeError>,
    ) -> Result<Fresh<T>, DecodeError> {
        Ok(Fresh::new(self.sample.read(read)?, self.freshness))
    }

    /// Its age and what it is made of, when the handler begins.
    pub fn freshness(&self) -> Freshness {
        self.freshness
    }
}

/// The queues of one collection.
#[derive(Debug)]
pub(crate) struct Collector {
    within: u64,
    depths: Vec<usize>,
    queues: Vec<VecDeque<Collected>>,
    bytes: usize,
    most_bytes: usize,
    /// Samples of each topic that left without a match and are not counted yet.
    pub(crate) dropped: Vec<u64>,
}

impl Collector {
    /// Queues for so many topics, which keep as many samples as they may.
    pub(crate) fn new(within: Duration, topics: usize) -> Self {
        Self {
            within: u64::try_from(within.as_nanos()).unwrap_or(u64::MAX),
            queues: (0..topics).map(|_| VecDeque::new()).collect(),
            depths: vec![MOST_SAMPLES; topics],
            bytes: 0,
            most_bytes: MOST_BYTES,
            dropped: vec![0; topics],
        }
    }

    /// Keeps at most so many samples of a topic: `depth` of its slot.
    pub(crate) fn set_depth(&mut self, topic: usize, depth: usize) {
        self.depths[topic] = depth.clamp(1, MOST_SAMPLES);
    }

    fn take(&mut self, topic: usize, place: usize) -> Option<Collected> {
        let sample = self.queues[topic].remove(place)?;
        self.bytes -= sample.sample.size();
        Some(sample)
    }

    /// Drops all samples: time was set back.
    pub(crate) fn clear(&mut self) {
        for topic in 0..self.queues.len() {
            self.clear_topic(topic);
        }
    }

    fn clear_topic(&mut self, topic: usize) {
        while !self.queues[topic].is_empty() {
            self.drop_oldest(topic);
        }
    }

    /// Drops what has become older than its slot takes.
    pub(crate) fn expire(&mut self, now: u64) {
        for topic in 0..self.queues.len() {
            let is_refused =
                |sample: &Collected| sample.refuses && !age(sample.at, now, sample.limit).1;
            while self.queues[topic].front().is_some_and(is_refused) {
                self.drop_oldest(topic);
            }
        }
    }

    /// Adds a sample. Returns one of each topic, in their order, if they match.
    pub(crate) fn add(&mut self, topic: usize, sample: Collected) -> Option<Vec<Collected>> {
        let at = sample.at;
        let is_old = |oldest: &Collected| oldest.at.saturating_sub(at) > SET_BACK.max(self.within);
        if self.queues[topic].front().is_some_and(is_old) {
            self.clear_topic(topic);
        }
        self.bytes += sample.sample.size();
        // A sample of the same time replaces the earlier one, as the key of a dictionary does.
        let place = self.queues[topic].partition_point(|earlier| earlier.at < at);
        if self.queues[topic]
            .get(place)
            .is_some_and(|same| same.at == at)
        {
            self.take(topic, place);
            self.dropped[topic] += 1;
        }
        self.queues[topic].insert(place, sample);
        while self.queues[topic].len() > self.depths[topic] {
            self.drop_oldest(topic);
        }
        while self.bytes > self.most_bytes {
            let oldest = (0..self.queues.len()).filter(|topic| !self.queues[*topic].is_empty());
            match oldest.min_by_key(|topic| self.queues[*topic][0].at) {
                Some(topic) => self.drop_oldest(topic),
                None => break,
            }
        }
        let chosen = self.matching(topic, at)?;
        let places = chosen.into_iter().enumerate();
        places
            .map(|(topic, place)| self.take(topic, place))
            .collect()
    }

    fn drop_oldest(&mut self, topic: usize) {
        if self.take(topic, 0).is_some() {
            self.dropped[topic] += 1;
        }
    }

    /// The place of the sample of each topic that matches the one of `topic` at this time.
    fn matching(&self, topic: usize, at: u64) -> Option<Vec<usize>> {
        let own = self.queues[topic]
            .iter()
            .position(|sample| sample.at == at)?;
        // The samples near enough, the nearest first.
        let near = |other: usize| {
            let samples = self.queues[other].iter().enumerate();
            let near = samples.filter(|(_, sample)| sample.at.abs_diff(at) <= self.within);
            let mut near: Vec<(u64, usize)> = near
                .map(|(place, sample)| (sample.at.abs_diff(at), place))
                .collect();
            near.sort_by_key(|(distance, _)| *distance);
            near.into_iter().map(|(_, place)| place).collect::<Vec<_>>()
        };
        let candidates: Vec<Vec<usize>> = (0..self.queues.len())
            .map(|other| {
                if other == topic {
                    vec![own]
                } else {
                    near(other)
                }
            })
            .collect();
        if !self.can_complete(0, (at, at)) {
            return None;
        }
        // The first choice of each topic that leaves one to the topics behind it: the order of an
        // odometer whose last digit turns first, without its ways into nothing.
        let mut span = (at, at);
        let mut chosen = Vec::with_capacity(candidates.len());
        for (topic, places) in candidates.iter().enumerate() {
            let mut places = places.iter().map(|place| {
                let at = self.queues[topic][*place].at;
                (*place, (span.0.min(at), span.1.max(at)))
            });
            let found = places.find(|(_, span)| self.can_complete(topic + 1, *span))?;
            span = found.1;
            chosen.push(found.0);
        }
        Some(chosen)
    }

    /// Whether each topic from this one on has a sample such that all are near enough to a first and
    /// a last one. A span of samples that fits can begin later until it begins with the first one or
    /// with one of theirs.
    fn can_complete(&self, topic: usize, (first, last): (u64, u64)) -> bool {
        let earliest = last.saturating_sub(self.within);
        if earliest > first {
            return false;
        }
        let rest = &self.queues[topic..];
        let begins = rest.iter().flatten().map(|sample| sample.at);
        let mut begins = begins
            .filter(|at| (earliest..=first).contains(at))
            .chain([first]);
        begins.any(|begin| {
            let end = begin.saturating_add(self.within);
            rest.iter().all(|queue| {
                let place = queue.partition_point(|sample| sample.at < begin);
                queue.get(place).is_some_and(|sample| sample.at <= end)
            })
        })
    }
}

#[cfg(test)]
mod tests;
