//! One replica: its elements, the changes that it has seen, and those that others have seen.

use crate::attributes::Attributes;
use crate::error::Error;
use crate::hash::range_of;
use crate::limits::{MOST_AHEAD, MOST_ELEMENTS, is_far_in_answer};
use crate::record::{Change, Delta, Record, Stamp, Vector, count, covers, raise};
use property_graph::{Id, Value};
use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, BTreeSet, HashSet};
use std::hash::{BuildHasher, RandomState};
use std::sync::Arc;

mod load;
mod told;
mod tombstones;

/// How many removals a replica remembers at most. It drops the others, even if some replica lacks
/// them.
pub const MOST_TOMBSTONES: usize = 1 << 14;

/// The content of an element.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Made {
    Node(Arc<str>),
    Edge(Arc<str>, Id, Id),
}

/// An element with the latest of each of its changes.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Element {
    /// Not known if an attribute arrived before its element.
    pub(crate) made: Option<(Stamp, Made)>,
    pub(crate) removed: Option<Stamp>,
    pub(crate) attributes: Attributes,
}

impl Element {
    /// Whether it becomes this. Of two contents with one stamp, all replicas keep the same one.
    fn becomes(&self, made: &Made) -> bool {
        let known = self.made.as_ref();
        known.is_none_or(|(_, known)| known > made)
    }
}

/// A number of a writer that no other one has, generated at random.
pub fn unique_writer() -> u64 {
    RandomState::new().hash_one(std::process::id())
}

/// One replica of a graph.
#[derive(Clone, Debug)]
pub struct Replica {
    writer: u64,
    count: u64,
    most_tombstones: usize,
    pub(crate) most_elements: usize,
    /// Whether it has made a change. Before that, it may undo changes of an earlier run.
    pub(crate) has_changed: bool,
    /// The changes that this replica makes, while they are recorded.
    made: Option<Vec<Record>>,
    pub(crate) elements: BTreeMap<Id, Element>,
    /// The edges that start or end at an element.
    pub(crate) edges: BTreeMap<Id, BTreeSet<Id>>,
    /// Elements that are removed and not forgotten, by writer and sequence of the first removal.
    tombstones: BTreeMap<u64, BTreeSet<(u64, Id)>>,
    /// Elements whose creation is not known, and removed ones, that `seen` does not cover.
    early: BTreeSet<Id>,
    /// Elements that another replica knows to be removed, and `seen` does not cover: they are
    /// accepted from no replica.
    gone: BTreeSet<Id>,
    seen: Vector,
    /// Up to which change of each writer removals are forgotten. A replica that has seen less gets
    /// the whole graph; it then removes each of its elements that the graph lacks.
    forgotten: Vector,
    /// The changes that other replicas have seen, as far as they reported them.
    pub(crate) others: BTreeMap<u64, Vector>,
    /// How many changes the forgotten replicas had seen. This only grows, so a message with no more
    /// is an earlier one.
    left: BTreeMap<u64, u128>,
}

impl Replica {
    /// An empty replica. Tombstones wait for all `others`, but for at most [`MOST_TOMBSTONES`]; a
    /// replica that joins later is added by its first message.
    pub fn new(writer: u64, others: impl IntoIterator<Item = u64>) -> Self {
        let others = others.into_iter().filter(|other| *other != writer);
        Self {
            writer,
            count: 0,
            most_tombstones: MOST_TOMBSTONES,
            most_elements: MOST_ELEMENTS,
            has_changed: false,
            made: None,
            elements: BTreeMap::new(),
            edges: BTreeMap::new(),
            tombstones: BTreeMap::new(),
            early: BTreeSet::new(),
            gone: BTreeSet::new(),
            seen: Vector::new(),
            forgotten: Vector::new(),
            others: others.map(|other| (other, Vector::new())).collect(),
            left: BTreeMap::new(),
        }
    }

    /// Sets the number of removals that it remembers at most.
    #[must_use]
    pub fn with_most_tombstones(mut self, most: usize) -> Self {
        self.most_tombstones = most;
        self
    }

    /// Sets the number of elements that it keeps at most, with removed ones and those that are not
    /// known yet.
    #[must_use]
    pub fn with_most_elements(mut self, most: usize) -> Self {
        self.most_elements = most;
        self
    }

    /// The writer.
    pub fn writer(&self) -> u64 {
        self.writer
    }

    /// How many changes of each writer are known without a gap.
    pub fn seen(&self) -> &Vector {
        &self.seen
    }

    /// Makes several changes, and returns them for other replicas.
    ///
    /// # Errors
    /// Those of `make`. The changes before the error are made.
    pub fn recorded<E: From<Error>>(
        &mut self,
        make: impl FnOnce(&mut Self) -> Result<(), E>,
    ) -> Result<Change, E> {
        let since = count(&self.seen, self.writer);
        self.made = Some(Vec::new());
        let result = make(self);
        let records = self.made.take().unwrap_or_default();
        result?;
        Ok(Change {
            writer: self.writer,
            since,
            upto: count(&self.seen, self.writer),
            records,
        })
    }

    /// The number of this writer's next change. A node or an edge that is made next has it in its id.
    pub fn next_number(&self) -> u64 {
        count(&self.seen, self.writer).saturating_add(1)
    }

    /// Leaves numbers of this writer out, so that its next change has this one.
    pub fn skip_to(&mut self, number: u64) {
        if number > self.next_number() {
            self.has_changed = true;
            self.seen.insert(self.writer, number - 1);
        }
    }

    fn stamp(&mut self) -> Result<Stamp, Error> {
        let sequence = count(&self.seen, self.writer).checked_add(1);
        let (Some(count), Some(sequence)) = (self.count.checked_add(1), sequence) else {
            return Err(Error::Exhausted);
        };
        self.count = count;
        self.has_changed = true;
        self.seen.insert(self.writer, sequence);
        Ok(Stamp {
            count,
            writer: self.writer,
            sequence,
        })
    }

    /// Adds a node.
    ///
    /// # Errors
    /// No type has this name, the replica keeps as many elements as it may, or no numbers are left for
    /// changes.
    pub fn add_node(&mut self, kind: &str) -> Result<Id, Error> {
        self.check_new(kind)?;
        let record = Record::Node {
            stamp: self.stamp()?,
            kind: kind.into(),
        };
        self.put(&record, true);
        Ok(record.of())
    }

    /// Adds an edge. An end of which nothing is known may arrive later.
    ///
    /// # Errors
    /// No type has this name, the replica keeps as many elements as it may, an end was removed, or no
    /// numbers are left for changes.
    pub fn add_edge(&mut self, kind: &str, from: Id, to: Id) -> Result<Id, Error> {
        self.check_new(kind)?;
        for end in [from, to] {
            if self.is_removed(end) {
                return Err(Error::EndRemoved(end));
            }
        }
        let record = Record::Edge {
            stamp: self.stamp()?,
            kind: kind.into(),
            from,
            to,
        };
        self.put(&record, true);
        Ok(record.of())
    }

    /// Whether an element was made and is not removed.
    pub fn has(&self, id: Id) -> bool {
        let element = self.elements.get(&id);
        element.is_some_and(|e| e.made.is_some() && e.removed.is_none())
    }

    /// Sets an attribute, or removes it. Returns whether there is such an element.
    ///
    /// # Errors
    /// No attribute has this name, no graph holds the value, the element has as many attributes as it may,
    /// or no numbers are left for changes.
    pub fn set(&mut self, of: Id, name: &str, value: Option<Value>) -> Result<bool, Error> {
        self.check_set(of, name, value.as_ref())?;
        let there = self.has(of);
        if there {
            let stamp = self.stamp()?;
            self.put(
                &Record::Attribute {
                    stamp,
                    of,
                    name: name.into(),
                    value,
                },
                true,
            );
        }
        Ok(there)
    }

    /// Whether an element was removed, also if that is forgotten.
    pub fn is_removed(&self, id: Id) -> bool {
        match self.elements.get(&id) {
            Some(element) => element.removed.is_some(),
            None => covers(&self.seen, id) || self.gone.contains(&id),
        }
    }

    /// Removes an element with the edges that start or end there. Returns whether there was such an
    /// element. An edge that another replica adds meanwhile becomes a conflict.
    ///
    /// # Errors
    /// No numbers are left for changes.
    pub fn remove(&mut self, of: Id) -> Result<bool, Error> {
        let there = self.has(of);
        if there {
            let mut all = vec![of];
            let mut seen = HashSet::from([of]);
            let mut at = 0;
            while let Some(id) = all.get(at) {
                at += 1;
                let edges = self.edges.get(id).into_iter().flatten().copied();
                let edges: Vec<Id> = edges.filter(|edge| self.has(*edge)).collect();
                all.extend(edges.into_iter().filter(|edge| seen.insert(*edge)));
            }
            // Edges before the elements at their ends.
            for of in all.into_iter().rev() {
                let stamp = self.stamp()?;
                self.put(&Record::Removed { stamp, of }, true);
            }
            if self.tombstones() > self.most_tombstones {
                self.sweep();
            }
        }
        Ok(there)
    }

    /// The edges that were added while another replica removed one of their ends, and the edges that
    /// start or end at such an edge, in the order of their ids: they are never shown again.
    pub fn dangling(&self) -> Vec<Id> {
        let ends = self.edges.keys().copied();
        let mut ends: Vec<Id> = ends.filter(|end| self.is_removed(*end)).collect();
        let mut dangling = BTreeSet::new();
        while let Some(end) = ends.pop() {
            let edges = self.edges.get(&end).into_iter().flatten().copied();
            for edge in edges.filter(|edge| self.has(*edge)) {
                if dangling.insert(edge) {
                    ends.push(edge);
                }
            }
        }
        dangling.into_iter().collect()
    }

    /// The value of an attribute. If a schema declares several attributes to be one value, this is
    /// the last value of that name: [`Replica::view`] shows only the one that was changed last.
    pub fn get(&self, of: Id, name: &str) -> Option<&Value> {
        let element = self.elements.get(&of).filter(|e| e.removed.is_none())?;
        element.attributes.get(name)?.1.as_ref()
    }

    /// When an attribute was last changed or removed.
    pub fn stamp_of(&self, of: Id, name: &str) -> Option<Stamp> {
        let element = self.elements.get(&of).filter(|e| e.removed.is_none())?;
        element.attributes.get(name).map(|(stamp, _)| *stamp)
    }

    /// The greatest count of all changes that are known.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Makes the changes that follow later than this count. Returns whether that was possible: a count
    /// may not be ahead by more than 2^48.
    pub fn count_from(&mut self, count: u64) -> bool {
        let is_sound = count.saturating_sub(self.count) <= MOST_AHEAD;
        if is_sound {
            self.count = self.count.max(count);
        }
        is_sound
    }

    /// Applies one change, of this replica or of another. It does not matter how often, or in which
    /// order.
    fn put(&mut self, record: &Record, is_local: bool) {
        let (stamp, id) = (record.stamp(), record.of());
        self.count = self.count.max(stamp.count);
        if let Some(made) = self.made.as_mut().filter(|_| is_local) {
            made.push(record.clone());
        }
        // Its own message may come back after it has removed the element.
        let is_first = is_local && matches!(record, Record::Node { .. } | Record::Edge { .. });
        let is_covered = covers(&self.seen, id);
        let is_gone = is_covered || self.gone.contains(&id);
        let element = match self.elements.entry(id) {
            Entry::Occupied(known) => known.into_mut(),
            // The removal is forgotten.
            Entry::Vacant(_) if is_gone && !is_first => return,
            Entry::Vacant(new) => new.insert(Element::default()),
        };
        let is_early = match record {
            Record::Node { .. } | Record::Edge { .. } => element.removed.is_some(),
            Record::Attribute { .. } => element.made.is_none() || element.removed.is_some(),
            Record::Removed { .. } => true,
        };
        match record {
            Record::Node { kind, .. } => {
                let made = Made::Node(Arc::clone(kind));
                if element.becomes(&made) {
                    let before = element.made.replace((stamp, made));
                    self.link(id, before);
                }
            }
            Record::Edge { kind, from, to, .. } => {
                let made = Made::Edge(Arc::clone(kind), *from, *to);
                if element.becomes(&made) {
                    let before = element.made.replace((stamp, made));
                    self.link(id, before);
                }
            }
            Record::Removed { .. } => {
                // The first removal counts, so that the tombstone goes as soon as it can.
                let known = element.removed;
                let first = known.map_or(stamp, |known| known.min(stamp));
                element.removed = Some(first);
                element.attributes = Attributes::default();
                if let Some(known) = known {
                    self.bury(known, id, false);
                }
                self.bury(first, id, true);
            }
            Record::Attribute { name, value, .. } if element.removed.is_none() => {
                let known = element.attributes.get(name);
                // Two different changes have one stamp if two replicas have one writer by mistake.
                let is_smaller =
                    |other: &Option<Value>| format!("{value:?}") < format!("{other:?}");
                if known.is_none_or(|(known, other)| {
                    *known < stamp || *known == stamp && is_smaller(other)
                }) {
                    element.attributes.insert(name, (stamp, value.clone()));
                }
            }
            Record::Attribute { .. } => {}
        }
        if is_early && !is_covered {
            self.early.insert(id);
        }
    }

    /// Notes the ends of an element with a new content, in place of those before.
    fn link(&mut self, id: Id, before: Option<(Stamp, Made)>) {
        if let Some((_, known)) = before {
            self.unlink(id, &known);
        }
        let element = self.elements.get(&id);
        if let Some((_, Made::Edge(_, from, to))) = element.and_then(|e| e.made.as_ref()) {
            for end in [from, to] {
                self.edges.entry(*end).or_default().insert(id);
            }
        }
    }

    /// Takes an edge from its ends.
    fn unlink(&mut self, id: Id, made: &Made) {
        if let Made::Edge(_, from, to) = made {
            for end in [from, to] {
                if let Some(edges) = self.edges.get_mut(end) {
                    edges.remove(&id);
                    if edges.is_empty() {
                        self.edges.remove(end);
                    }
                }
            }
        }
    }

    /// Takes the changes of another replica. Returns the elements that it is about, and those that it
    /// removes without naming them.
    ///
    /// # Errors
    /// The delta is damaged, has more than a replica keeps, or another replica has the same writer. Then
    /// nothing is changed. What else it says of the changes of others is believed, also that they
    /// were removed: accept deltas only from replicas that you trust.
    pub fn merge(&mut self, delta: &Delta) -> Result<BTreeSet<Id>, Error> {
        self.check(delta)?;
        Ok(self.merge_where(delta, |_, _| true))
    }

    /// Takes what another replica has changed, unless earlier changes of this writer are missing. It is about the
    /// elements of its records. A replica that takes nothing but changes and answers has what `seen` says and
    /// nothing else.
    ///
    /// # Errors
    /// Those of [`Replica::merge`].
    pub fn merge_change(&mut self, change: &Change) -> Result<(), Error> {
        self.check_change(change)?;
        if count(&self.seen, change.writer) < change.since {
            return Ok(());
        }
        for record in &change.records {
            self.put(record, false);
        }
        let seen = self.seen.entry(change.writer).or_default();
        *seen = (*seen).max(change.upto);
        self.settle();
        self.acknowledge(change.writer, &Vector::new());
        Ok(())
    }

    /// Takes the answer to a question of this replica, but for changes of a writer of which earlier ones are missing.
    /// A replica that joins late knows no number, so those of an answer may be up to 2^63.
    ///
    /// # Errors
    /// Those of [`Replica::merge`].
    pub fn merge_answer(&mut self, delta: &Delta) -> Result<BTreeSet<Id>, Error> {
        self.check_numbers(delta, is_far_in_answer)?;
        Ok(self.merge_without_gaps(delta))
    }

    fn merge_without_gaps(&mut self, delta: &Delta) -> BTreeSet<Id> {
        // A range has single changes of many writers.
        let is_part = delta.all_of.is_some_and(|(_, ranges)| ranges > 1);
        self.merge_where(delta, |seen, stamp| {
            let known = count(seen, stamp.writer);
            if is_part {
                stamp.sequence <= known
            } else {
                count(&delta.since, stamp.writer) <= known
            }
        })
    }

    fn merge_where(
        &mut self,
        delta: &Delta,
        is_wanted: impl Fn(&Vector, Stamp) -> bool,
    ) -> BTreeSet<Id> {
        let is_blank = self.is_blank();
        let mut touched = if is_blank {
            // Of a writer that is not known, all changes are wanted, or none.
            let none = Vector::new();
            self.load(&delta.records, |stamp| is_wanted(&none, stamp))
        } else {
            for record in &delta.records {
                if is_wanted(&self.seen, record.stamp()) {
                    self.put(record, false);
                }
            }
            delta.records.iter().map(Record::of).collect()
        };
        if let Some((range, ranges)) = delta.all_of {
            let is_gone = |id: &Id| {
                covers(&delta.upto, *id) && !touched.contains(id) && range_of(*id, ranges) == range
            };
            // Where nothing was known, all elements are listed, and ends of edges need not be.
            let elements = (!is_blank).then(|| self.elements.keys());
            let known = elements.into_iter().flatten().chain(self.edges.keys());
            for id in known.copied().filter(is_gone).collect::<Vec<Id>>() {
                self.drop_element(id);
                self.gone.insert(id);
                touched.insert(id);
            }
            raise(&mut self.forgotten, &delta.forgotten);
        }
        // The elements of a range are not all changes.
        if delta.all_of.is_none_or(|(_, ranges)| ranges <= 1) {
            for (writer, upto) in &delta.upto {
                let seen = self.seen.entry(*writer).or_default();
                // With a gap before them, the changes hold, but more are missing.
                if *seen >= count(&delta.since, *writer) {
                    *seen = (*seen).max(*upto);
                }
            }
        }
        self.settle();
        self.acknowledge(delta.sender, &delta.seen);
        touched
    }

    /// Whether a change with a stamp of this replica is not the one that it has made.
    pub(crate) fn contradicts(&self, record: &Record) -> bool {
        let stamp = record.stamp();
        let Some(element) = self.elements.get(&record.of()) else {
            return false;
        };
        let made = |made: &Made| {
            let known = element.made.as_ref();
            known.is_some_and(|(known, own)| *known != stamp || own != made)
        };
        match record {
            Record::Node { kind, .. } => made(&Made::Node(Arc::clone(kind))),
            Record::Edge { kind, from, to, .. } => made(&Made::Edge(Arc::clone(kind), *from, *to)),
            Record::Attribute { name, value, .. } => {
                let known = element.attributes.get(name);
                known.is_some_and(|(known, own)| *known == stamp && own != value)
            }
            Record::Removed { .. } => false,
        }
    }

    /// Drops entries that `seen` decides by now, and those beyond the limit.
    fn settle(&mut self) {
        if self.gone.is_empty() && self.early.is_empty() {
            return;
        }
        let seen = &self.seen;
        self.gone.retain(|id| !covers(seen, *id));
        let known: Vec<Id> = self.early.extract_if(.., |id| covers(seen, *id)).collect();
        for id in known {
            let element = self.elements.get(&id);
            if element.is_some_and(|e| e.made.is_none() && e.removed.is_none()) {
                // It was removed, or never made.
                self.drop_element(id);
            }
        }
        // If an attribute is lost by this, comparing ranges brings it again.
        while self.early.len() > self.most_tombstones
            && let Some(id) = self.early.pop_first()
        {
            if let Some(removed) = self.elements.get(&id).and_then(|e| e.removed) {
                raise(
                    &mut self.forgotten,
                    &[(removed.writer, removed.sequence)].into(),
                );
                self.gone.insert(id);
            }
            self.drop_element(id);
        }
        while self.gone.len() > MOST_TOMBSTONES {
            self.gone.pop_first();
        }
    }

    fn drop_element(&mut self, id: Id) {
        let Some(element) = self.elements.remove(&id) else {
            return;
        };
        self.early.remove(&id);
        if let Some(removed) = element.removed {
            self.bury(removed, id, false);
        }
        if let Some((_, made)) = element.made {
            self.unlink(id, &made);
        }
    }

    /// How many elements are kept, with removed ones and those that are not known yet.
    pub fn kept(&self) -> usize {
        self.elements.len()
    }
}
