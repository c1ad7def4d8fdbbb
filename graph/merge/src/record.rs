//! Changes, and what replicas tell each other about them.

use property_graph::{Id, Value};
use std::collections::BTreeMap;
use std::sync::Arc;

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

/// One change. A clone copies neither names nor values.
#[derive(Clone, Debug, PartialEq)]
pub enum Record {
    /// A node is new. Its id has the writer and the sequence of the stamp.
    Node {
        /// When, and by whom.
        stamp: Stamp,
        /// Type of the node.
        kind: Arc<str>,
    },
    /// An edge is new.
    Edge {
        /// When, and by whom.
        stamp: Stamp,
        /// The relation.
        kind: Arc<str>,
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
        name: Arc<str>,
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

/// What one writer has changed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Change {
    /// The writer.
    pub writer: u64,
    /// The changes are all those after this one…
    pub since: u64,
    /// …up to this one.
    pub upto: u64,
    /// The changes.
    pub records: Vec<Record>,
}

/// Changes for another replica.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Delta {
    /// The writer of the replica that sends it.
    pub sender: u64,
    /// The changes that the sender has seen.
    pub seen: Vector,
    /// The changes are all those after these…
    pub since: Vector,
    /// …up to these, but those that later ones have replaced.
    pub upto: Vector,
    /// Whether these are all elements of a range that there were up to then, as the range and the
    /// number of ranges: others were removed, and the sender may have forgotten that. The whole
    /// graph is range 0 of 1.
    pub all_of: Option<(usize, usize)>,
    /// Up to which change of each writer the sender has forgotten removals.
    pub forgotten: Vector,
    /// The changes.
    pub records: Vec<Record>,
}

/// How many changes of a writer a vector has.
pub(crate) fn count(vector: &Vector, writer: u64) -> u64 {
    vector.get(&writer).copied().unwrap_or_default()
}

/// How many changes of all writers a vector has.
pub(crate) fn total(vector: &Vector) -> u128 {
    vector.values().copied().map(u128::from).sum()
}

/// Whether these changes include that which made an element.
pub(crate) fn covers(vector: &Vector, id: Id) -> bool {
    count(vector, id.writer()) >= id.count()
}

/// Raises a vector to another one.
pub(crate) fn raise(vector: &mut Vector, other: &Vector) {
    for (writer, count) in other {
        let known = vector.entry(*writer).or_default();
        *known = (*known).max(*count);
    }
}
