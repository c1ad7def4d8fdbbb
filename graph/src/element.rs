//! Nodes and edges as the pages hold them.

use crate::names::Symbol;
use crate::stored::Attributes;
use innermodel::NodeId as Frame;
use std::sync::Arc;

/// No place.
pub(crate) const NONE: u32 = u32::MAX;

/// Names an element in all replicas and files: the writer that made it, and a count of this writer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Id(pub u128);

impl Id {
    /// The id of element number `count` of a writer.
    pub fn new(writer: u64, count: u64) -> Self {
        Self((u128::from(writer) << 64) | u128::from(count))
    }

    /// The writer that made the element.
    pub fn writer(self) -> u64 {
        (self.0 >> 64) as u64
    }

    /// How many elements the writer had made before.
    pub fn count(self) -> u64 {
        self.0 as u64
    }
}

/// A node, for as long as it is in the graph. After the node was removed, it names no node.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct NodeId {
    pub(crate) place: u32,
    pub(crate) generation: u32,
}

/// An edge, for as long as it is in the graph. After the edge was removed, it names no edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct EdgeId {
    pub(crate) place: u32,
    pub(crate) generation: u32,
}

/// A node or an edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Element {
    /// A node.
    Node(NodeId),
    /// An edge.
    Edge(EdgeId),
}

impl From<NodeId> for Element {
    fn from(node: NodeId) -> Self {
        Self::Node(node)
    }
}

impl From<EdgeId> for Element {
    fn from(edge: EdgeId) -> Self {
        Self::Edge(edge)
    }
}

/// All of a node that changes often.
#[derive(Clone, Debug)]
pub(crate) struct Node {
    pub(crate) id: Id,
    pub(crate) attributes: Attributes,
    pub(crate) frame: Option<Frame>,
    /// The place of the edge that the node represents, or [`NONE`]. Then the edge has the
    /// attributes.
    pub(crate) edge: u32,
}

/// An edge.
#[derive(Clone, Debug)]
pub(crate) struct Edge {
    pub(crate) id: Id,
    pub(crate) attributes: Attributes,
    /// Odd while the place is free.
    pub(crate) generation: u32,
    pub(crate) relation: Symbol,
    /// In a free place, the next free one.
    pub(crate) from: u32,
    pub(crate) to: u32,
}

/// One end of an edge, at the node of its other end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Half {
    pub(crate) node: NodeId,
    pub(crate) edge: u32,
    pub(crate) relation: Symbol,
}

/// How many ends a node holds without allocating memory.
const FEW: usize = 4;

/// The ends of a node in one direction, side by side.
#[derive(Clone, Debug)]
pub(crate) enum Halves {
    Few(u32, [Half; FEW]),
    Many(Arc<Vec<Half>>),
}

const NO_HALF: Half = Half {
    node: NodeId {
        place: NONE,
        generation: 1,
    },
    edge: NONE,
    relation: Symbol(NONE),
};

impl Halves {
    pub(crate) const NO: Self = Self::Few(0, [NO_HALF; FEW]);

    #[inline]
    pub(crate) fn all(&self) -> &[Half] {
        match self {
            Self::Few(count, halves) => halves.get(..*count as usize).unwrap_or_default(),
            Self::Many(halves) => halves,
        }
    }

    pub(crate) fn push(&mut self, half: Half) {
        match self {
            Self::Few(count, halves) => {
                if let Some(free) = halves.get_mut(*count as usize) {
                    *free = half;
                    *count += 1;
                } else {
                    let all = halves.iter().copied().chain([half]).collect();
                    *self = Self::Many(Arc::new(all));
                }
            }
            Self::Many(halves) => Arc::make_mut(halves).push(half),
        }
    }

    /// Removes the end of an edge. The others keep their order.
    pub(crate) fn remove(&mut self, edge: u32) {
        let Some(at) = self.all().iter().rposition(|half| half.edge == edge) else {
            return;
        };
        match self {
            Self::Few(count, halves) => {
                halves.copy_within(at + 1..*count as usize, at);
                *count -= 1;
            }
            Self::Many(halves) => {
                Arc::make_mut(halves).remove(at);
            }
        }
    }
}

/// The end of an edge, as a step along edges reads it.
#[derive(Clone, Debug)]
pub(crate) struct Place {
    /// Odd while the place is free.
    pub(crate) generation: u32,
    pub(crate) kind: Symbol,
    pub(crate) out: Halves,
}

/// The other lists that a node is in. Apart, since a step forward does not read them.
#[derive(Clone, Debug)]
pub(crate) struct Lists {
    pub(crate) generation: u32,
    pub(crate) in_: Halves,
    /// Nodes of the same type. In a free place, `next` is the next free one.
    pub(crate) of_type: Neighbours,
    /// Nodes of the same name.
    pub(crate) of_name: Neighbours,
}

/// The places before and after in a list.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Neighbours {
    pub(crate) previous: u32,
    pub(crate) next: u32,
}

impl Neighbours {
    pub(crate) const NO: Self = Self {
        previous: NONE,
        next: NONE,
    };
}
