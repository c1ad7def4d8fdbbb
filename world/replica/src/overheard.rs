//! Answers that replicas give each other, for who reads them and asks nothing, as of a recording.

use crate::answers::MOST_ANSWER;
use crate::content::Content;
use crate::message::{MOST_CHUNK, Message};
use crate::world::World;
use std::collections::BTreeMap;
use std::time::Duration;

/// How many answers are assembled at once.
const MOST_AT_ONCE: usize = 256;

/// Assembles chunks of answers.
#[derive(Debug, Default)]
pub struct Overheard {
    /// By who answers, who has asked, and the number of the question.
    answers: BTreeMap<(u64, u64, u64), Vec<Option<Vec<u8>>>>,
    bytes: usize,
}

impl Overheard {
    /// Takes a message, at a time as of [`World::receive`]. A replica gets the answer that it completes.
    pub fn take(&mut self, world: &World, now: Duration, message: &Message) {
        let Content::Chunk {
            sender,
            to,
            number,
            at,
            count,
            bytes,
        } = &message.0
        else {
            return;
        };
        let (at, count) = (*at as usize, *count as usize);
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
            let whole: Vec<u8> = chunks.into_iter().flatten().flatten().collect();
            self.bytes = self.bytes.saturating_sub(whole.len());
            world.overhear(now, &whole);
        }
    }
}
