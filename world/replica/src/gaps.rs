//! Changes that arrived before one that their writer made earlier. Nobody is shown a change without
//! those before it: it waits here until they are known, or nobody is left who could tell them.

use crate::wire;
use graph_merge::{Delta, Vector};
use property_graph::Time;
use std::collections::BTreeMap;

/// How many bytes wait at most. More is dropped, and asked for once its turn comes.
const MOST_WAITING: usize = 16 << 20;
/// About how many bytes a change takes in addition to its steps.
const EACH: usize = 1024;

/// Changes behind a gap, by writer and by what is before them.
#[derive(Default)]
pub(crate) struct Gaps {
    waiting: BTreeMap<u64, BTreeMap<u64, (Time, Delta)>>,
    bytes: usize,
}

fn size(delta: &Delta) -> usize {
    EACH + wire::size(&delta.records)
}

impl Gaps {
    /// Keeps a change of a writer for later: its time, and all steps after `since`.
    pub(crate) fn put(&mut self, since: u64, time: Time, delta: &Delta) {
        let size = size(delta);
        let all = self.waiting.entry(delta.sender).or_default();
        if self.bytes + size <= MOST_WAITING && !all.contains_key(&since) {
            all.insert(since, (time, delta.clone()));
            self.bytes += size;
        }
        if all.is_empty() {
            self.waiting.remove(&delta.sender);
        }
    }

    /// How many bytes wait.
    pub(crate) fn bytes(&self) -> usize {
        self.bytes
    }

    /// The next change before which nothing is missing any more. What is known by now is dropped.
    pub(crate) fn next(&mut self, seen: &Vector) -> Option<(Time, Delta)> {
        let known = |of: &Vector, writer: u64| of.get(&writer).copied().unwrap_or_default();
        let mut next = None;
        for (writer, all) in &mut self.waiting {
            let known_of = known(seen, *writer);
            while let Some(first) = all.first_entry().filter(|first| *first.key() <= known_of) {
                let (time, delta) = first.remove();
                self.bytes = self.bytes.saturating_sub(size(&delta));
                if known(&delta.upto, *writer) > known_of {
                    next = Some((time, delta));
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
        for (_, delta) in self.waiting.remove(&writer).unwrap_or_default().values() {
            self.bytes = self.bytes.saturating_sub(size(delta));
        }
    }
}
