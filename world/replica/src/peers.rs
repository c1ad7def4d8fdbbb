//! The other replicas, as far as they have announced themselves.

use crate::content::DigestOf;
use crate::digest;
use graph_merge::Vector;
use rc_diagnostics::foreign;
use std::collections::BTreeMap;
use std::time::Duration;

/// How many other replicas are known at most.
pub(crate) const MOST_PEERS: usize = 1024;
/// How many numbers of writers all of them announce at most.
const MOST_SEEN: usize = 1 << 18;
/// After this time without a message, a replica is no longer waited for.
pub(crate) const SILENT: Duration = Duration::from_secs(5);
/// After so long, it is no longer listed.
const UNLISTED: Duration = Duration::from_mins(1);
/// How many characters a name has at most.
const MOST_NAME: usize = 128;
/// How long a replica is not asked after an answer: it does not answer again before.
pub(crate) const PAUSE: Duration = Duration::from_millis(50);
/// How long it is not asked after a fruitless answer. The time doubles with each further one, up
/// to 64 times.
const FRUITLESS_PAUSE: Duration = Duration::from_secs(1);
/// How long it is not asked after it has said that it is busy.
const BUSY_PAUSE: Duration = Duration::from_millis(500);
/// After so long without an answer, a busy replica counts as one that does not answer.
const MOST_BUSY: Duration = Duration::from_mins(2);
/// After so many fruitless answers, or questions without a whole one, a replica that joins does not
/// wait for it.
const MOST_FRUITLESS: u32 = 3;

/// Another replica.
#[derive(Clone, Debug, Default)]
pub(crate) struct Peer {
    pub(crate) name: String,
    pub(crate) seen: Vector,
    pub(crate) ranges: Vec<u64>,
    pub(crate) elements: u64,
    pub(crate) conflicts: u32,
    pub(crate) heard: Duration,
    pub(crate) has_told: bool,
    pub(crate) is_silent: bool,
    pub(crate) is_leaving: bool,
    /// Its schema is another one.
    pub(crate) differs: bool,
    /// In how many digests, one after the other, it had other values of streams.
    pub(crate) other_streams: u32,
    /// Ranges that differ although it has seen the same changes.
    pub(crate) wrong_ranges: Vec<u32>,
    /// When it was last answered.
    pub(crate) answered: Option<Duration>,
    /// It is not asked before.
    pub(crate) ask_after: Duration,
    /// How many of its answers, one after the other, lacked changes that it had announced.
    pub(crate) fruitless: u32,
    /// How many questions, one after the other, it has not answered, or not completely.
    pub(crate) unanswered: u32,
    /// Since when it has said that it is busy, and nothing else.
    pub(crate) busy_since: Option<Duration>,
}

impl Peer {
    /// Whether it takes part.
    pub(crate) fn is_live(&self) -> bool {
        self.has_told && !self.is_silent && !self.is_leaving && !self.differs
    }

    pub(crate) fn digest(&self) -> u64 {
        digest::one(&self.ranges)
    }

    /// Whether it has changes that `seen` lacks.
    pub(crate) fn has_more(&self, seen: &Vector) -> bool {
        missing(&self.seen, seen) > 0
    }

    /// Notes an answer, and whether it lacked changes that were announced before the question.
    pub(crate) fn has_answered(&mut self, now: Duration, is_fruitless: bool) {
        self.unanswered = 0;
        self.busy_since = None;
        let pause = if is_fruitless {
            let doubled = FRUITLESS_PAUSE * (1 << self.fruitless.min(6));
            self.fruitless = self.fruitless.saturating_add(1);
            doubled
        } else {
            self.fruitless = 0;
            PAUSE
        };
        self.ask_after = now.saturating_add(pause);
    }

    /// Notes that it is busy with answers to others. Returns whether it counts as one that does not
    /// answer.
    pub(crate) fn has_postponed(&mut self, now: Duration) -> bool {
        self.ask_after = now.saturating_add(BUSY_PAUSE);
        let since = *self.busy_since.get_or_insert(now);
        let is_over = now.saturating_sub(since) >= MOST_BUSY;
        if is_over {
            self.unanswered = self.unanswered.saturating_add(1);
        }
        is_over
    }

    /// Whether its answers may still bring what it announces.
    pub(crate) fn is_useful(&self) -> bool {
        self.fruitless.max(self.unanswered) < MOST_FRUITLESS
    }

    /// How many changes it has not seen, of those that `seen` has.
    pub(crate) fn lag(&self, seen: &Vector) -> u64 {
        missing(seen, &self.seen)
    }
}

/// How many changes of a vector another one lacks.
pub(crate) fn missing(of: &Vector, from: &Vector) -> u64 {
    let all = of.iter();
    all.map(|(writer, count)| count.saturating_sub(from.get(writer).copied().unwrap_or_default()))
        .fold(0, u64::saturating_add)
}

/// The other replicas, by their writers.
#[derive(Debug, Default)]
pub(crate) struct Peers {
    pub(crate) all: BTreeMap<u64, Peer>,
}

impl Peers {
    /// Notes that a replica is there. `None` if too many are.
    pub(crate) fn hear(&mut self, writer: u64, now: Duration) -> Option<&mut Peer> {
        if self.all.len() >= MOST_PEERS && !self.all.contains_key(&writer) {
            return None;
        }
        let peer = self.all.entry(writer).or_default();
        peer.heard = now;
        peer.is_silent = false;
        Some(peer)
    }

    /// Notes the announcement of a replica. Returns whether it was not known before. `None` if that
    /// is too much, with the announcements of others.
    pub(crate) fn tell(
        &mut self,
        digest: &DigestOf,
        schema: u64,
        streams: u64,
        now: Duration,
    ) -> Option<bool> {
        let others = self
            .all
            .iter()
            .filter(|(writer, _)| **writer != digest.sender);
        let told: usize = others.map(|(_, peer)| peer.seen.len()).sum();
        if told.saturating_add(digest.seen.len()) > MOST_SEEN {
            return None;
        }
        let peer = self.hear(digest.sender, now)?;
        let is_new = !peer.has_told || peer.is_leaving;
        peer.has_told = true;
        if peer.name.is_empty() {
            let name: String = digest.name.chars().take(MOST_NAME).collect();
            peer.name = foreign::clean(&name);
        }
        peer.seen.clone_from(&digest.seen);
        peer.ranges.clone_from(&digest.ranges);
        peer.ranges.truncate(digest::RANGES);
        peer.elements = digest.elements;
        peer.conflicts = digest.conflicts;
        peer.is_leaving = digest.is_leaving;
        peer.differs = digest.schema != schema;
        peer.other_streams = if digest.streams == streams {
            0
        } else {
            peer.other_streams.saturating_add(1)
        };
        Some(is_new)
    }

    pub(crate) fn live(&self) -> impl Iterator<Item = (u64, &Peer)> {
        let all = self.all.iter().filter(|(_, peer)| peer.is_live());
        all.map(|(writer, peer)| (*writer, peer))
    }

    /// The replicas that are no longer waited for.
    pub(crate) fn sweep(&mut self, now: Duration) -> Vec<u64> {
        let mut gone = Vec::new();
        for (writer, peer) in &mut self.all {
            let is_over = now.saturating_sub(peer.heard) > SILENT || peer.is_leaving;
            if is_over && !peer.is_silent {
                peer.is_silent = true;
                gone.push(*writer);
            }
        }
        self.all
            .retain(|_, peer| now.saturating_sub(peer.heard) <= UNLISTED);
        gone
    }
}
