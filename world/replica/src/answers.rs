//! Questions about missing changes, and their answers, while they are under way.

use crate::digest::RANGES;
use crate::message::MOST_CHUNK;
use crate::peers::missing;
use crate::wire;
use graph_merge::{Delta, Record, Vector};
use std::collections::{BTreeMap, VecDeque};
use std::time::Duration;

/// How many bytes an answer has at most, and all together that are kept until they have arrived.
pub(crate) const MOST_ANSWER: usize = 64 << 20;
/// How many bytes the parts of a world have at most that wait for the others.
pub(crate) const MOST_PARTS: usize = 1 << 30;
/// How long an answer is kept without a question for a further chunk: longer than a replica asks for
/// missing ones.
pub(crate) const KEPT_FOR: Duration = Duration::from_secs(5);
/// How long it is kept at most for each of its chunks: a replica that takes less of it holds up
/// others.
const KEPT_FOR_EACH: Duration = Duration::from_secs(1);
/// Without a question for a further chunk for so long, an answer makes room for another one to the
/// same replica.
const IDLE: Duration = Duration::from_millis(600);
/// A replica that was told to ask again, and has not done so for so long, loses its place.
const PLACE_KEPT_FOR: Duration = Duration::from_secs(2);

/// A question of another replica.
pub(crate) struct Question {
    pub(crate) sender: u64,
    pub(crate) number: u64,
    pub(crate) since: Vector,
    pub(crate) ranges: Vec<u32>,
    pub(crate) chunks: Vec<u32>,
}

impl Question {
    /// How many ranges the replica lacks; more than all if it asks for everything.
    fn lacks(&self) -> usize {
        if self.ranges.is_empty() {
            RANGES + 1
        } else {
            self.ranges.len()
        }
    }
}

/// A question of this replica that is not answered yet.
pub(crate) struct Asked {
    pub(crate) to: u64,
    pub(crate) number: u64,
    pub(crate) since: Vector,
    /// The changes that the other replica had announced.
    pub(crate) announced: Vector,
    pub(crate) ranges: Vec<u32>,
    pub(crate) heard: Duration,
    pub(crate) tries: u32,
    /// Empty until the first chunk arrives.
    pub(crate) chunks: Vec<Option<Vec<u8>>>,
    /// How many chunks are on the way.
    pub(crate) waiting: usize,
}

/// The bytes of an answer of which all chunks are here.
pub(crate) fn whole(chunks: &[Option<Vec<u8>>]) -> Vec<u8> {
    let chunks: Vec<&[u8]> = chunks.iter().flatten().map(Vec::as_slice).collect();
    chunks.concat()
}

/// An answer of this replica.
pub(crate) struct Answer {
    pub(crate) to: u64,
    pub(crate) number: u64,
    pub(crate) bytes: Vec<u8>,
    pub(crate) made: Duration,
    /// When a further chunk was last asked for.
    pub(crate) asked: Duration,
    /// All chunks before this one were asked for.
    pub(crate) reached: usize,
    /// What the other replica has seen once this has arrived. `None` if the answer has ranges that
    /// differ.
    pub(crate) upto: Option<Vector>,
    /// Whether the other replica has seen all of it.
    pub(crate) has_arrived: bool,
}

/// A world that arrives in several answers, because one does not hold it: range by range.
pub(crate) struct Parts {
    /// The replica that has it.
    pub(crate) from: u64,
    /// What the first answer says of the changes: the world is that of this time.
    first: Delta,
    ranges: BTreeMap<usize, Vec<Record>>,
    bytes: usize,
}

impl Parts {
    /// Whether an answer is a part of a world: ranges, although nobody has asked for these.
    pub(crate) fn are(deltas: &[Delta]) -> bool {
        let are = |delta: &Delta| delta.all_of.is_some_and(|(_, ranges)| ranges == RANGES);
        !deltas.is_empty() && deltas.iter().all(are)
    }

    /// Begins with an answer.
    pub(crate) fn begin(from: u64, deltas: &[Delta]) -> Self {
        let first = deltas.first().map(|delta| Delta {
            sender: delta.sender,
            seen: delta.seen.clone(),
            since: delta.since.clone(),
            upto: delta.upto.clone(),
            forgotten: delta.forgotten.clone(),
            all_of: Some((0, 1)),
            records: Vec::new(),
        });
        let first = first.unwrap_or_default();
        Self {
            from,
            bytes: wire::size_of(&first),
            first,
            ranges: BTreeMap::new(),
        }
    }

    /// Adds an answer. Returns whether there is room for it.
    pub(crate) fn add(&mut self, deltas: Vec<Delta>) -> bool {
        let upto = &self.first.upto;
        for delta in deltas {
            let Some((range, _)) = delta.all_of else {
                continue;
            };
            // Later changes of a writer follow in their order.
            let is_earlier = |record: &Record| {
                let stamp = record.stamp();
                upto.get(&stamp.writer)
                    .is_some_and(|upto| stamp.sequence <= *upto)
            };
            let records: Vec<Record> = delta.records.into_iter().filter(is_earlier).collect();
            self.bytes += wire::size(&records);
            self.ranges.insert(range, records);
        }
        self.bytes <= MOST_PARTS
    }

    /// About how many bytes they have.
    pub(crate) fn bytes(&self) -> usize {
        self.bytes
    }

    /// The ranges that have not arrived.
    pub(crate) fn missing(&self) -> Vec<u32> {
        let all = (0..RANGES).filter(|range| !self.ranges.contains_key(range));
        all.map(|range| range as u32).collect()
    }

    /// All of it as one answer.
    pub(crate) fn whole(self) -> Delta {
        Delta {
            records: self.ranges.into_values().flatten().collect(),
            ..self.first
        }
    }
}

/// Questions and answers.
#[derive(Default)]
pub(crate) struct Answers {
    pub(crate) asked: Option<Asked>,
    pub(crate) parts: Option<Parts>,
    pub(crate) number: u64,
    pub(crate) kept: Vec<Answer>,
    /// The replicas that were told to ask again, and when each of them asked last. The first one has
    /// waited longest.
    waiting: VecDeque<(u64, Duration)>,
    /// The replica that got the last answer, and how many ranges it lacked before: it gets the
    /// others first.
    turn: (u64, usize),
    /// The last one that was asked.
    pub(crate) last: u64,
    /// Whether somebody who had nothing was answered since the values of streams were last repeated.
    pub(crate) has_new: bool,
}

impl Answer {
    pub(crate) fn count(&self) -> usize {
        self.bytes.len().div_ceil(MOST_CHUNK).max(1)
    }

    /// Notes a question for these chunks.
    pub(crate) fn ask(&mut self, chunks: &[usize], now: Duration) {
        let reached = chunks.iter().map(|at| at + 1).max().unwrap_or_default();
        if reached > self.reached {
            self.reached = reached;
            self.asked = now;
        }
    }

    /// Whether nobody waits for it any more.
    fn is_over(&self, now: Duration) -> bool {
        let most = KEPT_FOR.saturating_add(KEPT_FOR_EACH.saturating_mul(self.count() as u32));
        now.saturating_sub(self.asked) >= KEPT_FOR || now.saturating_sub(self.made) >= most
    }

    /// Whether the other replica is still asking for its chunks.
    fn is_under_way(&self, now: Duration) -> bool {
        self.reached < self.count() && now.saturating_sub(self.asked) < IDLE
    }
}

impl Answers {
    /// Drops the answers that no replica asks for any more.
    pub(crate) fn expire(&mut self, now: Duration) {
        self.kept.retain(|answer| !answer.is_over(now));
        self.waiting
            .retain(|(_, asked)| now.saturating_sub(*asked) < PLACE_KEPT_FOR);
    }

    /// Notes what another replica has seen: it may be all that the answer to it brings.
    pub(crate) fn acknowledge(&mut self, to: u64, seen: &Vector) {
        for answer in self.kept.iter_mut().filter(|answer| answer.to == to) {
            let upto = answer.upto.as_ref();
            answer.has_arrived |= upto.is_some_and(|upto| missing(upto, seen) == 0);
        }
    }

    /// Whether a replica is still asking for the chunks of an answer to it. Who asks for something
    /// new in its name takes nothing away from it.
    pub(crate) fn are_under_way(&self, to: u64, now: Duration) -> bool {
        let mut own = self.kept.iter().filter(|answer| answer.to == to);
        own.any(|answer| answer.is_under_way(now))
    }

    /// Whether a new answer of so many bytes has room beside those that are on the way, and it is
    /// the turn of its replica. All together have `most` bytes, with small ones half as many more.
    pub(crate) fn have_room(&self, question: &Question, bytes: usize, most: usize) -> bool {
        let to = question.sender;
        let others = self.kept.iter();
        let others = others.filter(|other| other.to != to && !other.has_arrived);
        let others: usize = others.map(|other| other.bytes.len()).sum();
        // What a replica has missed does not wait for a newcomer.
        let is_small = bytes <= most / 16;
        let most = if is_small { most + most / 2 } else { most };
        let first = self.waiting.front();
        let is_its_turn = is_small
            || first.is_none_or(|(first, _)| *first == to)
            || self.turn.0 == to && question.lacks() < self.turn.1;
        is_its_turn && (others == 0 || others + bytes <= most)
    }

    /// Notes that a replica was told to ask again, because there is no room for an answer. It keeps
    /// its place among those that wait.
    pub(crate) fn postpone(&mut self, to: u64, now: Duration) {
        // It has what it asked for before, or has given that up.
        for answer in self.kept.iter_mut().filter(|answer| answer.to == to) {
            answer.has_arrived = true;
        }
        match self.waiting.iter_mut().find(|(own, _)| *own == to) {
            Some((_, asked)) => *asked = now,
            None => self.waiting.push_back((to, now)),
        }
    }

    /// Keeps an answer until it has arrived. Returns its place. Others that have arrived make room for it.
    pub(crate) fn keep(&mut self, question: &Question, answer: Answer, most: usize) -> usize {
        self.turn = (question.sender, question.lacks());
        self.waiting.retain(|(own, _)| *own != answer.to);
        self.kept.retain(|other| other.to != answer.to);
        let bytes: usize = self.kept.iter().map(|other| other.bytes.len()).sum();
        if bytes + answer.bytes.len() > most {
            self.kept.retain(|other| !other.has_arrived);
        }
        self.kept.push(answer);
        self.kept.len() - 1
    }
}
