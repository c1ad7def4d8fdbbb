//! One replica: its records, what it has seen, and what others have seen.

use property_graph::{Id, Value};
use std::collections::BTreeMap;
use std::hash::{BuildHasher, RandomState};

/// When something was changed: a Lamport count, then the writer decides.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Stamp {
    /// Greater than all that the writer had seen.
    pub count: u64,
    /// The writer.
    pub writer: u64,
    /// Number of the change among those of its writer, from 1.
    pub sequence: u64,
}

/// How many changes of each writer are known without a gap.
pub type Vector = BTreeMap<u64, u64>;

/// One change.
#[derive(Clone, Debug, PartialEq)]
pub enum Record {
    /// A node is new. Its id has the writer and the sequence of the stamp.
    Node {
        /// When, and by whom.
        stamp: Stamp,
        /// Type of the node.
        kind: String,
    },
    /// An edge is new.
    Edge {
        /// When, and by whom.
        stamp: Stamp,
        /// The relation.
        kind: String,
        /// The node where it starts.
        from: Id,
        /// The node where it ends.
        to: Id,
    },
    /// An attribute has another value, or none.
    Attribute {
        /// When, and by whom.
        stamp: Stamp,
        /// The element.
        of: Id,
        /// Name of the attribute.
        name: String,
        /// The value.
        value: Option<Value>,
    },
    /// An element is removed.
    Removed {
        /// When, and by whom.
        stamp: Stamp,
        /// The element.
        of: Id,
    },
}

impl Record {
    /// When, and by whom.
    pub fn stamp(&self) -> Stamp {
        match self {
            Self::Node { stamp, .. }
            | Self::Edge { stamp, .. }
            | Self::Attribute { stamp, .. }
            | Self::Removed { stamp, .. } => *stamp,
        }
    }

    /// The element that it is about.
    pub fn of(&self) -> Id {
        match self {
            Self::Node { stamp, .. } | Self::Edge { stamp, .. } => {
                Id::new(stamp.writer, stamp.sequence)
            }
            Self::Attribute { of, .. } | Self::Removed { of, .. } => *of,
        }
    }
}

/// Changes for another replica.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Delta {
    /// The writer of the replica that sends it.
    pub sender: u64,
    /// What the sender has seen.
    pub seen: Vector,
    /// The changes are all those after these…
    pub since: Vector,
    /// …up to these, but those that later ones have replaced.
    pub upto: Vector,
    /// The changes.
    pub records: Vec<Record>,
}

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
    seen: Vector,
    /// What other replicas have seen, as far as they told.
    others: BTreeMap<u64, Vector>,
}

impl Replica {
    /// An empty replica. Tombstones wait for all `others`; a replica that joins later is added by
    /// its first message.
    pub fn new(writer: u64, others: impl IntoIterator<Item = u64>) -> Self {
        let others = others.into_iter().filter(|other| *other != writer);
        Self {
            writer,
            count: 0,
            elements: BTreeMap::new(),
            seen: Vector::new(),
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
        self.count += 1;
        let sequence = self.seen.entry(self.writer).or_default();
        *sequence += 1;
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

    /// Removes an element. Edges of a removed node are not in the view. Nothing happens if there is
    /// no such element.
    pub fn remove(&mut self, of: Id) -> bool {
        let there = self.has(of);
        if there {
            let stamp = self.stamp();
            self.put(&Record::Removed { stamp, of }, true);
        }
        there
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
            }
            Record::Removed { .. } => {
                // The first removal counts, so that the tombstone goes as soon as it can.
                let first = element.removed.is_none_or(|known| stamp < known);
                if first {
                    element.removed = Some(stamp);
                }
                element.attributes.clear();
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

    /// The changes that a replica with this vector lacks. An empty vector asks for all of them.
    pub fn delta_since(&self, since: &Vector) -> Delta {
        Delta {
            sender: self.writer,
            seen: self.seen.clone(),
            since: since.clone(),
            upto: self.seen.clone(),
            records: self.records(&|stamp| {
                stamp.sequence > since.get(&stamp.writer).copied().unwrap_or_default()
            }),
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

    /// Notes what another replica has seen, and drops tombstones that all have seen.
    pub fn acknowledge(&mut self, sender: u64, seen: &Vector) {
        if sender != self.writer {
            let known = self.others.entry(sender).or_default();
            for (writer, count) in seen {
                let known = known.entry(*writer).or_default();
                *known = (*known).max(*count);
            }
        }
        let all_have = |stamp: &Stamp| {
            let has = |seen: &Vector| {
                seen.get(&stamp.writer)
                    .is_some_and(|n| *n >= stamp.sequence)
            };
            has(&self.seen) && self.others.values().all(has)
        };
        let gone: Vec<Id> = self
            .elements
            .iter()
            .filter(|(_, element)| {
                let made = element.made.as_ref();
                element.removed.as_ref().is_some_and(all_have)
                    && made.is_some_and(|(stamp, _)| all_have(stamp))
            })
            .map(|(id, _)| *id)
            .collect();
        for id in gone {
            self.elements.remove(&id);
        }
    }

    /// How many tombstones are kept.
    pub fn tombstones(&self) -> usize {
        let removed = self.elements.values().filter(|e| e.removed.is_some());
        removed.count()
    }

    /// Digests of the living elements, by ranges of their ids: replicas are equal if these are. A
    /// digest that differs names the range in which to look.
    pub fn digests(&self, ranges: usize) -> Vec<u64> {
        let ranges = ranges.max(1);
        let mut digests = vec![0_u64; ranges];
        for (id, element) in &self.elements {
            let Some(made) = element.made.as_ref().filter(|_| element.removed.is_none()) else {
                continue;
            };
            let mut hash = Fnv::default();
            hash.add(&format!("{id:?}{made:?}"));
            for attribute in &element.attributes {
                hash.add(&format!("{attribute:?}"));
            }
            let range = Fnv::of(&format!("{id:?}")) as usize % ranges;
            // The order of ids does not matter.
            digests[range] = digests[range].wrapping_add(hash.0);
        }
        digests
    }

    /// All changes about the elements of a range, for a replica whose digest differs.
    pub fn range(&self, range: usize, ranges: usize) -> Delta {
        let ranges = ranges.max(1);
        let records = self.records(&|_| true).into_iter();
        let of = |record: &Record| Fnv::of(&format!("{:?}", record.of())) as usize % ranges;
        Delta {
            sender: self.writer,
            seen: self.seen.clone(),
            since: Vector::new(),
            upto: Vector::new(),
            records: records.filter(|record| of(record) == range).collect(),
        }
    }
}

/// The hash FNV-1a: equal on all machines.
struct Fnv(u64);

impl Default for Fnv {
    fn default() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }
}

impl Fnv {
    fn add(&mut self, text: &str) {
        for byte in text.bytes() {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }

    fn of(text: &str) -> u64 {
        let mut hash = Self::default();
        hash.add(text);
        hash.0
    }
}
