//! Removals that are remembered until all other replicas have seen them.

use super::Replica;
use crate::record::{Stamp, Vector, count, covers, raise, total};
use property_graph::Id;
use std::collections::{BTreeSet, btree_set};
use std::ops::Bound;

/// How many forgotten replicas are remembered.
const MOST_LEFT: usize = 1024;

impl Replica {
    /// Adds a tombstone, or takes it away.
    pub(super) fn bury(&mut self, removed: Stamp, id: Id, is_there: bool) {
        let all = self.tombstones.entry(removed.writer).or_default();
        if is_there {
            all.insert((removed.sequence, id));
            return;
        }
        all.remove(&(removed.sequence, id));
        if all.is_empty() {
            self.tombstones.remove(&removed.writer);
        }
    }

    /// Notes what another replica has seen, and forgets removals that all have seen.
    pub fn acknowledge(&mut self, sender: u64, seen: &Vector) {
        if seen.is_empty() && self.others.contains_key(&sender) {
            return self.sweep();
        }
        // Removals are of writers that are known here: messages about others need no memory.
        let known = seen.iter().filter(|(w, _)| self.seen.contains_key(w));
        let seen: Vector = known.map(|(w, upto)| (*w, *upto)).collect();
        // A late message of a replica that has left does not bring it back.
        let is_late = self
            .left
            .get(&sender)
            .is_some_and(|left| total(&seen) <= *left);
        if sender != self.writer && !is_late {
            self.left.remove(&sender);
            raise(self.others.entry(sender).or_default(), &seen);
        }
        self.sweep();
    }

    /// Stops waiting for a replica until it sends something newer. Then it gets the whole graph if
    /// it lacks a removal, and keeps its changes made meanwhile.
    pub fn forget(&mut self, writer: u64) {
        if let Some(seen) = self.others.remove(&writer) {
            self.left.insert(writer, total(&seen));
            if self.left.len() > MOST_LEFT {
                self.left.pop_first();
            }
        }
        self.sweep();
    }

    /// Forgets removals that all have seen, and more if there are too many.
    pub(super) fn sweep(&mut self) {
        if self.tombstones.is_empty() {
            return;
        }
        // The last tombstone of a writer that all have seen.
        let upto = |writer: u64| {
            let others = self.others.values().chain([&self.seen]);
            let upto = others.map(|seen| count(seen, writer)).min();
            (upto.unwrap_or_default(), Id(u128::MAX))
        };
        // The creation of an element is known then, so a late message about it does not restore it.
        let known = |writer: u64, all: btree_set::Range<'_, (u64, Id)>| {
            let known = all.filter(|(_, id)| covers(&self.seen, *id));
            let known = known.map(move |(sequence, id)| (writer, *sequence, *id));
            known.collect::<Vec<(u64, u64, Id)>>()
        };
        let mut gone = Vec::new();
        for (writer, all) in &self.tombstones {
            gone.extend(known(*writer, all.range(..=upto(*writer))));
        }
        let most = gone.len() + self.most_tombstones;
        let many = self.tombstones().saturating_sub(most);
        if many > 0 {
            let kept = self.tombstones.iter().flat_map(|(writer, all)| {
                let after = (Bound::Excluded(upto(*writer)), Bound::Unbounded);
                known(*writer, all.range(after))
            });
            gone.extend(kept.take(many));
        }
        for (writer, sequence, id) in gone {
            raise(&mut self.forgotten, &[(writer, sequence)].into());
            self.drop_element(id);
        }
    }

    /// How many tombstones are kept.
    pub fn tombstones(&self) -> usize {
        self.tombstones.values().map(BTreeSet::len).sum()
    }
}
