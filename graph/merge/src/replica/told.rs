//! What a replica tells another one, and what one that knows nothing takes of it.

use super::load::Loaded;
use super::{Made, Replica};
use crate::hash::range_of;
use crate::record::{Delta, Record, Stamp, Vector, count};
use property_graph::Id;
use std::collections::BTreeSet;
use std::sync::Arc;

impl Replica {
    /// The changes that a replica with this vector lacks. An empty vector asks for all of them. A
    /// replica that lacks a removal which is forgotten gets the whole graph.
    pub fn delta_since(&self, since: &Vector) -> Delta {
        let mut forgotten = self.forgotten.iter();
        if forgotten.any(|(writer, upto)| count(since, *writer) < *upto) {
            return self.range(0, 1);
        }
        let wanted = |_, stamp: Stamp| stamp.sequence > count(since, stamp.writer);
        Delta {
            since: since.clone(),
            records: self.records(wanted),
            ..self.empty_delta()
        }
    }

    fn empty_delta(&self) -> Delta {
        Delta {
            sender: self.writer,
            seen: self.seen.clone(),
            upto: self.seen.clone(),
            forgotten: self.forgotten.clone(),
            ..Delta::default()
        }
    }

    fn records(&self, wanted: impl Fn(Id, Stamp) -> bool) -> Vec<Record> {
        let mut records = Vec::new();
        for (id, element) in &self.elements {
            if let Some((stamp, made)) = element
                .made
                .as_ref()
                .filter(|(stamp, _)| wanted(*id, *stamp))
            {
                let stamp = *stamp;
                records.push(match made {
                    Made::Node(kind) => Record::Node {
                        stamp,
                        kind: Arc::clone(kind),
                    },
                    Made::Edge(kind, from, to) => Record::Edge {
                        stamp,
                        kind: Arc::clone(kind),
                        from: *from,
                        to: *to,
                    },
                });
            }
            if let Some(stamp) = element.removed.filter(|stamp| wanted(*id, *stamp)) {
                records.push(Record::Removed { stamp, of: *id });
            }
            for (name, (stamp, value)) in element.attributes.iter() {
                if wanted(*id, *stamp) {
                    records.push(Record::Attribute {
                        stamp: *stamp,
                        of: *id,
                        name: Arc::clone(name),
                        value: value.clone(),
                    });
                }
            }
        }
        records
    }

    /// All elements of a range, for a replica whose digest differs. It removes each of its elements
    /// of the range that is not among them although this replica has seen it.
    pub fn range(&self, range: usize, ranges: usize) -> Delta {
        Delta {
            all_of: Some((range, ranges)),
            records: self.records(|id, _| range_of(id, ranges) == range),
            ..self.empty_delta()
        }
    }

    /// Whether nothing is known that could contradict a record.
    pub(super) fn is_blank(&self) -> bool {
        self.elements.is_empty()
            && self.edges.is_empty()
            && self.gone.is_empty()
            && self.seen.is_empty()
    }

    /// Applies changes of another replica where nothing is known, those of the writers that are wanted.
    /// Returns the elements that all are about.
    pub(super) fn load(
        &mut self,
        records: &[Record],
        is_wanted: impl Fn(Stamp) -> bool,
    ) -> BTreeSet<Id> {
        let loaded = Loaded::of(records, is_wanted);
        self.count = self.count.max(loaded.count);
        self.elements = loaded.elements;
        for edge in loaded.edges {
            self.link(edge, None);
        }
        for record in loaded.rest {
            self.put(record, false);
        }
        loaded.touched
    }
}
