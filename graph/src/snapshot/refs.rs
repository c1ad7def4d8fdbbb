//! A node and an edge of a version, to ask them.

use super::Snapshot;
use crate::element::{Edge, EdgeId, Half, Id, NodeId, Place};
use crate::names::{Named, Symbol};
use crate::stored::Stored;
use crate::value::Value;

/// A node of a version.
#[derive(Clone, Copy, Debug)]
pub struct NodeRef<'s> {
    pub(super) snapshot: &'s Snapshot,
    pub(super) node: NodeId,
    pub(super) place: &'s Place,
}

impl<'s> NodeRef<'s> {
    /// Names the node in all versions of this graph.
    pub fn node_id(&self) -> NodeId {
        self.node
    }

    /// Names the node in all replicas.
    pub fn id(&self) -> Id {
        let node = self.snapshot.nodes.get(self.node.place as usize);
        node.map(|node| node.id).unwrap_or_default()
    }

    /// Number of the type.
    pub fn kind(&self) -> Symbol {
        self.place.kind
    }

    /// Name of the type.
    pub fn type_name(&self) -> &'s str {
        self.snapshot.text(self.place.kind)
    }

    /// The attribute `name`, or nothing.
    pub fn name(&self) -> &'s str {
        let name = self.get(self.snapshot.types.name);
        name.and_then(Value::as_str).unwrap_or_default()
    }

    /// The value of an attribute.
    pub fn get(&self, attribute: impl Named) -> Option<&'s Value> {
        self.snapshot.get(self.node, attribute)
    }

    /// All attributes that were set, in the order of their symbols.
    pub fn attributes(&self) -> impl Iterator<Item = (&'s str, &'s Value)> + use<'s> {
        let attributes = self.snapshot.attributes(self.node.into());
        listed(self.snapshot, attributes.ok().and_then(|a| a.as_deref()))
    }

    /// Edges from the node.
    pub fn out_edges(&self) -> impl Iterator<Item = EdgeRef<'s>> + use<'s> {
        self.snapshot.edges_of(self.place.out.all(), None)
    }

    /// Edges to the node.
    pub fn in_edges(&self) -> impl Iterator<Item = EdgeRef<'s>> + use<'s> {
        let halves = self.snapshot.incoming(self.node);
        self.snapshot.edges_of(halves, None)
    }
}

fn listed<'s>(
    snapshot: &'s Snapshot,
    attributes: Option<&'s [(Symbol, Stored)]>,
) -> impl Iterator<Item = (&'s str, &'s Value)> + use<'s> {
    let all = attributes.unwrap_or_default().iter();
    all.map(|(symbol, stored)| (snapshot.text(*symbol), stored.value()))
}

/// An edge of a version.
#[derive(Clone, Copy, Debug)]
pub struct EdgeRef<'s> {
    pub(super) snapshot: &'s Snapshot,
    pub(super) id: EdgeId,
    pub(super) edge: &'s Edge,
}

impl<'s> EdgeRef<'s> {
    /// Names the edge in all versions of this graph.
    pub fn edge_id(&self) -> EdgeId {
        self.id
    }

    /// Names the edge in all replicas.
    pub fn id(&self) -> Id {
        self.edge.id
    }

    /// Number of the relation.
    pub fn relation(&self) -> Symbol {
        self.edge.relation
    }

    /// Name of the relation.
    pub fn type_name(&self) -> &'s str {
        self.snapshot.text(self.edge.relation)
    }

    /// The node where the edge starts. An edge goes with its nodes, so both are there.
    pub fn from(&self) -> NodeId {
        self.end(self.edge.from)
    }

    /// The node where the edge ends.
    pub fn to(&self) -> NodeId {
        self.end(self.edge.to)
    }

    fn end(&self, place: u32) -> NodeId {
        let generation = self.snapshot.shape.places.get(place as usize);
        NodeId {
            place,
            generation: generation.map_or(1, |place| place.generation),
        }
    }

    /// The value of an attribute.
    pub fn get(&self, attribute: impl Named) -> Option<&'s Value> {
        self.snapshot.get(self.id, attribute)
    }

    /// All attributes that were set, in the order of their symbols.
    pub fn attributes(&self) -> impl Iterator<Item = (&'s str, &'s Value)> + use<'s> {
        listed(self.snapshot, self.edge.attributes.as_deref())
    }
}

/// A step from a node along an edge.
#[derive(Clone, Copy, Debug)]
pub struct Step<'s> {
    pub(super) snapshot: &'s Snapshot,
    pub(super) half: &'s Half,
    pub(super) is_forth: bool,
}

impl<'s> Step<'s> {
    /// Whether it leads from the start of the edge to its end.
    #[inline]
    pub fn is_forth(&self) -> bool {
        self.is_forth
    }

    /// The node at the other end.
    #[inline]
    pub fn node(&self) -> NodeId {
        self.half.node
    }

    /// Number of the relation.
    #[inline]
    pub fn relation(&self) -> Symbol {
        self.half.relation
    }

    /// Tells the edge from all others of this version.
    #[inline]
    pub fn number(&self) -> u32 {
        self.half.edge
    }

    /// The edge. An edge goes with its nodes, so it is there.
    #[inline]
    pub fn edge(&self) -> Option<EdgeRef<'s>> {
        let edge = self.snapshot.edges.get(self.half.edge as usize)?;
        Some(EdgeRef {
            snapshot: self.snapshot,
            id: EdgeId {
                place: self.half.edge,
                generation: edge.generation,
            },
            edge,
        })
    }
}
