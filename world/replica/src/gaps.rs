//! Changes that arrived before one that their writer made earlier. Nobody is shown a change without
//! those before it: it waits here until they are known, or nobody is left who could tell them.

use crate::wire;
use graph_merge::{Change, Vector};
use property_graph::Time;
use std::collections::BTreeMap;

/// How many bytes wait at most. More is dropped, and asked for once its turn comes.
const MOST_WAITING: usize = 16 << 20;
/// About how many bytes a change takes in addition to its steps.
const EACH: usize = 1024;

/// Changes behind a gap, by writer and by what is before them.
#[derive(Default)]
pub(crate) struct Gaps {
    waiting: BTreeMap<u64, BTreeMap<u64, (Time, Change)>>,
    bytes: usize,
}

fn size(change: &Change) -> usize {
    EACH + wire::size(&change.records)
}

impl Gaps {
    /// Keeps a change for later, with its time.
    pub(crate) fn put(&mut self, time: Time, change: Change) {
        let (writer, size) = (change.writer, size(&change));
        let all = self.waiting.entry(writer).or_default();
        if self.bytes + size <= MOST_WAITING && !all.contains_key(&change.since) {
            all.insert(change.since, (time, change));
            self.bytes += size;
        }
        if all.is_empty() {
            self.waiting.remove(&writer);
        }
    }

    /// How many bytes wait.
    pub(crate) fn bytes(&self) -> usize {
        self.bytes
    }

    /// The next change before which nothing is missing any more. What is known by now is dropped.
    pub(crate) fn next(&mut self, seen: &Vector) -> Option<(Time, Change)> {
        if self.waiting.is_empty() {
            return None;
        }
        let mut next = None;
        for (writer, all) in &mut self.waiting {
            let known_of = seen.get(writer).copied().unwrap_or_default();
            while let Some(first) = all.first_entry().filter(|first| *first.key() <= known_of) {
                let (time, change) = first.remove();
                self.bytes = self.bytes.saturating_sub(size(&change));
                if change.upto > known_of {
                    next = Some((time, change));
                    break;
                }
            }
            if next.is_some() {
                break;
            }
        }
        self.waiting.retain(|_, all| !all.is_empty());
        next
    }

    /// Drops the changes of a writer of which nothing more is heard. If it comes back, they are asked for.
    pub(crate) fn forget(&mut self, writer: u64) {
        for (_, change) in self.waiting.remove(&writer).unwrap_or_default().values() {
            self.bytes = self.bytes.saturating_sub(size(change));
        }
    }
}
