//! One replica: its elements, what it has seen, and what others have seen.

use crate::digest::range_of;
use crate::record::{Delta, Record, Stamp, Vector, covers, raise};
use property_graph::{Id, Value};
use std::collections::{BTreeMap, BTreeSet, HashSet};
use std::hash::{BuildHasher, RandomState};

/// How many removals a replica remembers at most. Older ones are forgotten, whoever lacks them.
pub const MOST_TOMBSTONES: usize = 1 << 14;

/// What an element is made of.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Made {
    Node(String),
    Edge(String, Id, Id),
}

/// An element with the latest of each of its changes.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Element {
    /// Not known if an attribute arrived before its element.
    pub(crate) made: Option<(Stamp, Made)>,
    pub(crate) removed: Option<Stamp>,
    pub(crate) attributes: BTreeMap<String, (Stamp, Option<Value>)>,
}

/// A number of a writer that no other one has, made by nobody's hand.
pub fn unique_writer() -> u64 {
    RandomState::new().hash_one(std::process::id())
}

/// One replica of a graph.
#[derive(Clone, Debug)]
pub struct Replica {
    writer: u64,
    count: u64,
    pub(crate) elements: BTreeMap<Id, Element>,
    /// The edges that start or end at an element.
    edges: BTreeMap<Id, BTreeSet<Id>>,
    /// Elements that are removed and not forgotten, by writer and sequence of the first removal.
    tombstones: BTreeMap<u64, BTreeSet<(u64, Id)>>,
    seen: Vector,
    /// Up to which change of each writer removals are forgotten. Who has seen less gets the whole
    /// graph: what it has and the graph does not was removed.
    forgotten: Vector,
    /// What other replicas have seen, as far as they told.
    others: BTreeMap<u64, Vector>,
}

impl Replica {
    /// An empty replica. Tombstones wait for all `others`, but for at most [`MOST_TOMBSTONES`]; a
    /// replica that joins later is added by its first message.
    pub fn new(writer: u64, others: impl IntoIterator<Item = u64>) -> Self {
        let others = others.into_iter().filter(|other| *other != writer);
        Self {
            writer,
            count: 0,
            elements: BTreeMap::new(),
            edges: BTreeMap::new(),
            tombstones: BTreeMap::new(),
            seen: Vector::new(),
            forgotten: Vector::new(),
            others: others.map(|other| (other, Vector::new())).collect(),
        }
    }

    /// The writer.
    pub fn writer(&self) -> u64 {
        self.writer
    }

    /// How many changes of each writer are known without a gap.
    pub fn seen(&self) -> &Vector {
        &self.seen
    }

    fn stamp(&mut self) -> Stamp {
        // Others may send any count.
        self.count = self.count.saturating_add(1);
        let sequence = self.seen.entry(self.writer).or_default();
        *sequence = sequence.saturating_add(1);
        Stamp {
            count: self.count,
            writer: self.writer,
            sequence: *sequence,
        }
    }

    /// Adds a node.
    pub fn add_node(&mut self, kind: &str) -> Id {
        let stamp = self.stamp();
        let record = Record::Node {
            stamp,
            kind: kind.to_owned(),
        };
        self.put(&record, true);
        record.of()
    }

    /// Adds an edge.
    pub fn add_edge(&mut self, kind: &str, from: Id, to: Id) -> Id {
        let stamp = self.stamp();
        let record = Record::Edge {
            stamp,
            kind: kind.to_owned(),
            from,
            to,
        };
        self.put(&record, true);
        record.of()
    }

    /// Whether an element was made and is not removed.
    pub fn has(&self, id: Id) -> bool {
        let element = self.elements.get(&id);
        element.is_some_and(|e| e.made.is_some() && e.removed.is_none())
    }

    /// Sets an attribute, or removes it. Nothing happens if there is no such element.
    pub fn set(&mut self, of: Id, name: &str, value: Option<Value>) -> bool {
        let there = self.has(of);
        if there {
            let stamp = self.stamp();
            self.put(
                &Record::Attribute {
                    stamp,
                    of,
                    name: name.to_owned(),
                    value,
                },
                true,
            );
        }
        there
    }

    /// Whether an element was removed, also if that is forgotten.
    pub(crate) fn is_removed(&self, id: Id) -> bool {
        match self.elements.get(&id) {
            Some(element) => element.removed.is_some(),
            None => covers(&self.seen, id),
        }
    }

    /// Removes an element with the edges that start or end there. Nothing happens if there is no such
    /// element. An edge that another replica adds meanwhile becomes a conflict.
    pub fn remove(&mut self, of: Id) -> bool {
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
            // Edges before what is at their ends.
            for of in all.into_iter().rev() {
                let stamp = self.stamp();
                self.put(&Record::Removed { stamp, of }, true);
            }
            if self.tombstones() > MOST_TOMBSTONES {
                self.sweep();
            }
        }
        there
    }

    /// The edges that were added while another replica removed one of their ends: they are never
    /// shown again.
    pub fn dangling(&self) -> Vec<Id> {
        let edges = self.elements.iter().filter(|(_, e)| e.removed.is_none());
        let edges = edges.filter_map(|(id, element)| match &element.made {
            Some((_, Made::Edge(_, from, to))) => Some((*id, *from, *to)),
            _ => None,
        });
        let dangling = edges.filter(|(_, from, to)| self.is_removed(*from) || self.is_removed(*to));
        dangling.map(|(id, ..)| id).collect()
    }

    /// The value of an attribute.
    pub fn get(&self, of: Id, name: &str) -> Option<&Value> {
        let element = self.elements.get(&of).filter(|e| e.removed.is_none())?;
        element.attributes.get(name)?.1.as_ref()
    }

    /// Applies one change, of this replica or of another. It does not matter how often, or in which
    /// order.
    fn put(&mut self, record: &Record, is_local: bool) {
        let (stamp, id) = (record.stamp(), record.of());
        self.count = self.count.max(stamp.count);
        // Its own message may come back after it has removed the element.
        let is_first = is_local && matches!(record, Record::Node { .. } | Record::Edge { .. });
        let known = self.seen.get(&id.writer()).copied().unwrap_or_default();
        if !self.elements.contains_key(&id) && known >= id.count() && !is_first {
            // The element was removed, and all have seen that.
            return;
        }
        let element = self.elements.entry(id).or_default();
        match record {
            Record::Node { kind, .. } => {
                element.made = Some((stamp, Made::Node(kind.clone())));
            }
            Record::Edge { kind, from, to, .. } => {
                element.made = Some((stamp, Made::Edge(kind.clone(), *from, *to)));
                for end in [from, to] {
                    self.edges.entry(*end).or_default().insert(id);
                }
            }
            Record::Removed { .. } => {
                // The first removal counts, so that the tombstone goes as soon as it can.
                let known = element.removed;
                let first = known.map_or(stamp, |known| known.min(stamp));
                element.removed = Some(first);
                element.attributes.clear();
                if let Some(known) = known {
                    self.bury(known, id, false);
                }
                self.bury(first, id, true);
            }
            Record::Attribute { name, value, .. } if element.removed.is_none() => {
                let known = element.attributes.get(name);
                if known.is_none_or(|(known, _)| *known < stamp) {
                    let value = (stamp, value.clone());
                    element.attributes.insert(name.clone(), value);
                }
            }
            Record::Attribute { .. } => {}
        }
    }

    /// The changes that a replica with this vector lacks. An empty vector asks for all of them. A
    /// replica that lacks a removal which is forgotten gets the whole graph.
    pub fn delta_since(&self, since: &Vector) -> Delta {
        let count = |writer: &u64| since.get(writer).copied().unwrap_or_default();
        let mut forgotten = self.forgotten.iter();
        let is_whole = forgotten.any(|(writer, upto)| count(writer) < *upto);
        let since_then = |stamp: &Stamp| stamp.sequence > count(&stamp.writer);
        Delta {
            sender: self.writer,
            seen: self.seen.clone(),
            since: if is_whole {
                Vector::new()
            } else {
                since.clone()
            },
            upto: self.seen.clone(),
            is_whole,
            forgotten: self.forgotten.clone(),
            records: self.records(&|stamp| is_whole || since_then(stamp)),
        }
    }

    fn records(&self, wanted: &dyn Fn(&Stamp) -> bool) -> Vec<Record> {
        let mut records = Vec::new();
        for (id, element) in &self.elements {
            if let Some((stamp, made)) = element.made.as_ref().filter(|(stamp, _)| wanted(stamp)) {
                let stamp = *stamp;
                records.push(match made {
                    Made::Node(kind) => Record::Node {
                        stamp,
                        kind: kind.clone(),
                    },
                    Made::Edge(kind, from, to) => Record::Edge {
                        stamp,
                        kind: kind.clone(),
                        from: *from,
                        to: *to,
                    },
                });
            }
            if let Some(stamp) = element.removed.filter(|stamp| wanted(stamp)) {
                records.push(Record::Removed { stamp, of: *id });
            }
            for (name, (stamp, value)) in &element.attributes {
                if wanted(stamp) {
                    records.push(Record::Attribute {
                        stamp: *stamp,
                        of: *id,
                        name: name.clone(),
                        value: value.clone(),
                    });
                }
            }
        }
        records
    }

    /// Takes the changes of another replica.
    pub fn merge(&mut self, delta: &Delta) {
        for record in &delta.records {
            self.put(record, false);
        }
        if delta.is_whole {
            let listed: HashSet<Id> = delta.records.iter().map(Record::of).collect();
            let own = self.elements.keys().copied();
            let gone = own.filter(|id| covers(&delta.upto, *id) && !listed.contains(id));
            for id in gone.collect::<Vec<Id>>() {
                self.drop_element(id);
            }
            raise(&mut self.forgotten, &delta.forgotten);
        }
        for (writer, upto) in &delta.upto {
            let since = delta.since.get(writer).copied().unwrap_or_default();
            let seen = self.seen.entry(*writer).or_default();
            // With a gap before them, the changes hold, but more are missing.
            if *seen >= since {
                *seen = (*seen).max(*upto);
            }
        }
        self.acknowledge(delta.sender, &delta.seen);
    }

    /// Adds a tombstone, or takes it away.
    fn bury(&mut self, removed: Stamp, id: Id, is_there: bool) {
        let all = self.tombstones.entry(removed.writer).or_default();
        if is_there {
            all.insert((removed.sequence, id));
        } else {
            all.remove(&(removed.sequence, id));
        }
    }

    fn drop_element(&mut self, id: Id) {
        let Some(element) = self.elements.remove(&id) else {
            return;
        };
        if let Some(removed) = element.removed {
            self.bury(removed, id, false);
        }
        if let Some((_, Made::Edge(_, from, to))) = element.made {
            for end in [from, to] {
                if let Some(edges) = self.edges.get_mut(&end) {
                    edges.remove(&id);
                    if edges.is_empty() {
                        self.edges.remove(&end);
                    }
                }
            }
        }
    }

    /// Notes what another replica has seen, and forgets removals that all have seen.
    pub fn acknowledge(&mut self, sender: u64, seen: &Vector) {
        if sender != self.writer {
            raise(self.others.entry(sender).or_default(), seen);
        }
        self.sweep();
    }

    /// Waits no longer for a replica, until it sends something again. Then it gets the whole graph if
    /// it lacks a removal, and keeps what it has changed meanwhile.
    pub fn forget(&mut self, writer: u64) {
        self.others.remove(&writer);
        self.sweep();
    }

    /// Forgets removals that all have seen, and old ones if there are too many.
    fn sweep(&mut self) {
        let count = |seen: &Vector, writer: u64| seen.get(&writer).copied().unwrap_or_default();
        let mut gone: Vec<(u64, u64, Id)> = Vec::new();
        // What made an element is known then: a late message about it brings nothing back.
        let is_known = |id: &Id| covers(&self.seen, *id);
        for (writer, all) in &self.tombstones {
            let others = self.others.values().chain([&self.seen]);
            let upto = others.map(|seen| count(seen, *writer)).min();
            let seen = all.range(..=(upto.unwrap_or_default(), Id(u128::MAX)));
            let seen = seen.filter(|(_, id)| is_known(id));
            gone.extend(seen.map(|(sequence, id)| (*writer, *sequence, *id)));
        }
        let many = self
            .tombstones()
            .saturating_sub(gone.len() + MOST_TOMBSTONES);
        let most = self.tombstones.iter().max_by_key(|(_, all)| all.len());
        if many > 0
            && let Some((writer, all)) = most
        {
            let old = all.iter().filter(|(_, id)| is_known(id)).take(many);
            gone.extend(old.map(|(sequence, id)| (*writer, *sequence, *id)));
        }
        for (writer, sequence, id) in gone {
            let forgotten = self.forgotten.entry(writer).or_default();
            *forgotten = (*forgotten).max(sequence);
            self.drop_element(id);
        }
    }

    /// How many tombstones are kept.
    pub fn tombstones(&self) -> usize {
        self.tombstones.values().map(BTreeSet::len).sum()
    }

    /// All changes about the elements of a range, for a replica whose digest differs.
    pub fn range(&self, range: usize, ranges: usize) -> Delta {
        let ranges = ranges.max(1);
        let records = self.records(&|_| true).into_iter();
        let is_in = |record: &Record| range_of(record.of(), ranges) == range;
        Delta {
            sender: self.writer,
            seen: self.seen.clone(),
            records: records.filter(is_in).collect(),
            ..Delta::default()
        }
    }
}
