//! Questions about missing changes, and their answers, while they are under way.

use crate::message::MOST_CHUNK;
use graph_merge::Vector;
use std::time::Duration;

/// How many bytes an answer has at most, and all together that are kept until they have arrived.
pub(crate) const MOST_ANSWER: usize = 64 << 20;
/// How long an answer is kept after its last question: longer than a replica asks for missing chunks.
pub(crate) const KEPT_FOR: Duration = Duration::from_secs(5);

/// A question of another replica.
pub(crate) struct Question {
    pub(crate) sender: u64,
    pub(crate) number: u64,
    pub(crate) since: Vector,
    pub(crate) ranges: Vec<u32>,
    pub(crate) chunks: Vec<u32>,
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

/// An answer of this replica.
pub(crate) struct Answer {
    pub(crate) to: u64,
    pub(crate) number: u64,
    pub(crate) bytes: Vec<u8>,
    /// When it was last asked for.
    pub(crate) asked: Duration,
}

/// Questions and answers.
#[derive(Default)]
pub(crate) struct Answers {
    pub(crate) asked: Option<Asked>,
    pub(crate) number: u64,
    pub(crate) kept: Vec<Answer>,
    /// The last one that was asked.
    pub(crate) last: u64,
    /// Whether somebody who had nothing was answered since the values of streams were last repeated.
    pub(crate) has_new: bool,
}

impl Answer {
    pub(crate) fn count(&self) -> usize {
        self.bytes.len().div_ceil(MOST_CHUNK).max(1)
    }
}

impl Answers {
    /// Drops the answers that no replica asks for any more.
    pub(crate) fn expire(&mut self, now: Duration) {
        self.kept
            .retain(|answer| now.saturating_sub(answer.asked) < KEPT_FOR);
    }

    /// Keeps an answer until it has arrived. Returns its place, or `None` if the others that are on the
    /// way leave no room for it.
    pub(crate) fn keep(&mut self, answer: Answer) -> Option<usize> {
        self.kept.retain(|other| other.to != answer.to);
        let bytes: usize = self.kept.iter().map(|other| other.bytes.len()).sum();
        if !self.kept.is_empty() && bytes + answer.bytes.len() > MOST_ANSWER {
            return None;
        }
        self.kept.push(answer);
        Some(self.kept.len() - 1)
    }
}
