//! The elements of a graph that nothing contradicts, built at once.

use super::{Element, Made};
use crate::record::{Record, Stamp};
use property_graph::Id;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// Records as elements. A replica tells its elements in the order of their ids, and each before its
/// attributes: these need no decision.
pub(super) struct Loaded<'r> {
    /// What all records are about.
    pub(super) touched: BTreeSet<Id>,
    pub(super) elements: BTreeMap<Id, Element>,
    /// Those that are edges.
    pub(super) edges: Vec<Id>,
    /// The greatest count of the elements.
    pub(super) count: u64,
    /// Records that do not fit. Changes may be applied in any order, so they follow one by one.
    pub(super) rest: Vec<&'r Record>,
}

impl<'r> Loaded<'r> {
    /// The elements of records, of the writers that are wanted.
    pub(super) fn of(records: &'r [Record], is_wanted: impl Fn(Stamp) -> bool) -> Self {
        // An element with two attributes has three records.
        let mut touched: Vec<Id> = Vec::with_capacity(records.len() / 3);
        let mut all: Vec<(Id, Element)> = Vec::with_capacity(records.len() / 3);
        let (mut edges, mut rest, mut count) = (Vec::new(), Vec::new(), 0);
        // Most changes are of the writer of those before them.
        let mut last: Option<(u64, bool)> = None;
        for record in records {
            let (stamp, id) = (record.stamp(), record.of());
            if touched.last() != Some(&id) {
                touched.push(id);
            }
            let is_taken = match last {
                Some((writer, is_taken)) if writer == stamp.writer => is_taken,
                _ => is_wanted(stamp),
            };
            last = Some((stamp.writer, is_taken));
            if !is_taken {
                continue;
            }
            let before = all.last_mut().map(|(id, element)| (*id, element));
            let is_next = before.as_ref().is_none_or(|(before, _)| *before < id);
            let made = match (record, before) {
                (Record::Node { kind, .. }, _) if is_next => Made::Node(Arc::clone(kind)),
                (Record::Edge { kind, from, to, .. }, _) if is_next => {
                    edges.push(id);
                    Made::Edge(Arc::clone(kind), *from, *to)
                }
                (Record::Attribute { name, value, .. }, Some((own, element)))
                    if own == id && element.attributes.is_last(name) =>
                {
                    count = count.max(stamp.count);
                    element.attributes.push(name, (stamp, value.clone()));
                    continue;
                }
                _ => {
                    rest.push(record);
                    continue;
                }
            };
            count = count.max(stamp.count);
            let element = Element {
                made: Some((stamp, made)),
                ..Element::default()
            };
            all.push((id, element));
        }
        Self {
            touched: touched.into_iter().collect(),
            elements: all.into_iter().collect(),
            edges,
            count,
            rest,
        }
    }
}
