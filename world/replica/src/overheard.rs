//! Answers that replicas give each other, for who reads them and asks nothing, as of a recording.

use crate::answers::{MOST_ANSWER, MOST_PARTS, Parts, whole};
use crate::content::Content;
use crate::message::{MOST_CHUNK, Message};
use crate::wire;
use crate::world::World;
use graph_merge::Delta;
use std::collections::{BTreeMap, BTreeSet};

/// How many answers are assembled at once.
const MOST_AT_ONCE: usize = 256;

/// Names an answer: the replica that answers, the one that has asked, and the number of the question.
type Key = (u64, u64, u64);

/// Assembles chunks of answers, and worlds that arrive in parts.
#[derive(Default)]
pub struct Overheard {
    answers: BTreeMap<Key, Vec<Option<Vec<u8>>>>,
    bytes: usize,
    /// The questions for whatever there is: ranges as the answer are parts of a world.
    wholes: BTreeSet<Key>,
    /// By the replica that answers, and the one that has asked.
    parts: BTreeMap<(u64, u64), Parts>,
}

impl Overheard {
    /// Takes a message. A replica gets the answer that it completes.
    pub fn take(&mut self, world: &World, message: &Message) {
        let (sender, to, number, at, count, bytes) = match &message.0 {
            Content::Ask {
                sender,
                to,
                number,
                ranges,
                ..
            } if ranges.is_empty() => {
                if self.wholes.len() >= MOST_AT_ONCE {
                    self.wholes.clear();
                }
                self.wholes.insert((*to, *sender, *number));
                return;
            }
            Content::Chunk {
                sender,
                to,
                number,
                at,
                count,
                bytes,
            } => (sender, to, number, at, count, bytes),
            _ => return,
        };
        let (at, count) = (*at as usize, *count as usize);
        if count == 0 {
            // It is busy: a later question has another number.
            self.wholes.remove(&(*sender, *to, *number));
            return;
        }
        let is_sound =
            at < count && count <= MOST_ANSWER / MOST_CHUNK + 1 && bytes.len() <= MOST_CHUNK;
        if !is_sound {
            return;
        }
        // Answers of which a part was lost.
        if self.bytes + bytes.len() > 2 * MOST_ANSWER || self.answers.len() >= MOST_AT_ONCE {
            self.answers.clear();
            self.bytes = 0;
        }
        let key = (*sender, *to, *number);
        let chunks = self.answers.entry(key);
        let chunks = chunks.or_insert_with(|| vec![None; count]);
        if chunks.len() != count || chunks[at].is_some() {
            return;
        }
        self.bytes += bytes.len();
        chunks[at] = Some(bytes.clone());
        if chunks.iter().all(Option::is_some) {
            let chunks = self.answers.remove(&key).unwrap_or_default();
            let whole = whole(&chunks);
            self.bytes = self.bytes.saturating_sub(whole.len());
            match wire::read_answer(&whole) {
                Ok(deltas) => world.overhear(self.joined(key, deltas)),
                Err(error) => world.refuse(&error.to_string()),
            }
        }
    }

    /// What a replica may take of an answer: nothing of a part, and the world once all parts are there.
    fn joined(&mut self, key: Key, deltas: Vec<Delta>) -> Vec<Delta> {
        let is_whole = self.wholes.remove(&key);
        let between = (key.0, key.1);
        // A new question for everything ends the earlier one.
        let known = self.parts.remove(&between).filter(|_| !is_whole);
        if !Parts::are(&deltas) || known.is_none() && !is_whole {
            return deltas;
        }
        let mut parts = known.unwrap_or_else(|| Parts::begin(key.0, &deltas));
        if !parts.add(deltas) {
            return Vec::new();
        }
        if parts.missing().is_empty() {
            return vec![parts.whole()];
        }
        let others: usize = self.parts.values().map(Parts::bytes).sum();
        if others + parts.bytes() > MOST_PARTS || self.parts.len() >= MOST_AT_ONCE {
            self.parts.clear();
        }
        self.parts.insert(between, parts);
        Vec::new()
    }
}
