//! One version of a world.

use crate::error::Error;
use crate::kind::Kind;
use crate::units;
use property_graph::{Element, NodeId, NodeRef, Point, Pose, Snapshot, Symbol, Value};
use std::ops::Deref;
use std::sync::Arc;

/// One version of a world, which never changes. It dereferences to the version of a graph without types.
#[derive(Clone, Debug)]
pub struct View(pub Arc<Snapshot>);

impl Deref for View {
    type Target = Snapshot;

    fn deref(&self) -> &Snapshot {
        &self.0
    }
}

/// What names a node: its id, an element with a type, or its name, if no other node has it.
pub trait End: Sized {
    /// The node.
    ///
    /// # Errors
    /// No node has the name, or several have it.
    fn node(self, snapshot: &Snapshot) -> Result<NodeId, Error>;
}

impl End for NodeId {
    fn node(self, _: &Snapshot) -> Result<NodeId, Error> {
        Ok(self)
    }
}

impl End for NodeRef<'_> {
    fn node(self, _: &Snapshot) -> Result<NodeId, Error> {
        Ok(self.node_id())
    }
}

impl End for &str {
    fn node(self, snapshot: &Snapshot) -> Result<NodeId, Error> {
        single("node", self, snapshot.named(self))
    }
}

/// The one node of several with a name.
pub(crate) fn single(
    kind: &'static str,
    name: &str,
    mut found: impl Iterator<Item = NodeId>,
) -> Result<NodeId, Error> {
    let name = || rc_diagnostics::foreign::clean(name);
    match (found.next(), found.next()) {
        (Some(node), None) => Ok(node),
        (None, _) => Err(Error::Unknown { kind, name: name() }),
        (Some(_), Some(_)) => Err(Error::Ambiguous { kind, name: name() }),
    }
}

impl View {
    /// The version without types.
    pub fn snapshot(&self) -> &Snapshot {
        &self.0
    }

    /// All elements of a type, and of those that inherit from it.
    pub fn all<K: Kind>(&self) -> impl Iterator<Item = K::In<'_>> {
        K::all(&self.0)
    }

    /// The node of a type, or of one that inherits from it, whose attribute `name` is this text.
    ///
    /// # Errors
    /// No such node has the name, or several have it.
    pub fn one<K: Kind>(&self, name: &str) -> Result<K::In<'_>, Error> {
        let nodes = self.named(name);
        let nodes = nodes.filter(|node| K::of(self, Element::Node(*node)).is_some());
        let node = single(K::NAME, name, nodes)?;
        K::of(self, node.into()).ok_or_else(|| property_graph::Error::Removed.into())
    }

    /// The edge of a type from a node to another one, if there is one. Of several, it is the oldest.
    ///
    /// # Errors
    /// A name does not denote exactly one node.
    pub fn between_nodes<K: Kind>(
        &self,
        from: impl End,
        to: impl End,
    ) -> Result<Option<K::In<'_>>, Error> {
        let (from, to) = (from.node(self)?, to.node(self)?);
        let relation: Option<Symbol> = self.symbol(K::NAME);
        let edges = self.out_edges(from, relation);
        let mut edges = edges.filter(|edge| relation.is_some() && edge.to() == to);
        let edge = edges.next();
        Ok(edge.and_then(|edge| K::of(self, edge.edge_id().into())))
    }

    /// The coordinates in `to` of a point with these coordinates in `from`, in the unit of the schema's
    /// translations.
    ///
    /// # Errors
    /// A name does not denote exactly one node, or no edges with poses connect the nodes.
    pub fn transform(&self, to: impl End, point: Point, from: impl End) -> Result<Point, Error> {
        let (to, from) = (self.frame(to.node(self)?)?, self.frame(from.node(self)?)?);
        Ok(self.0.transform(to, point, from)?)
    }

    /// The number of an attribute in a unit: `number_in(door.node_id(), "width", "cm")`. `None` if it has no
    /// value.
    ///
    /// # Errors
    /// The attribute has no unit, or one of another kind.
    pub fn number_in(
        &self,
        element: impl Into<Element>,
        attribute: &str,
        unit: &str,
    ) -> Result<Option<f64>, Error> {
        let element = element.into();
        let own = units::unit_of(self, element, attribute)?;
        let conversion = units::conversion(attribute, &own, unit)?;
        let value = self.get(element, attribute).and_then(Value::as_f64);
        Ok(value.map(|value| conversion.apply(value)))
    }

    /// The pose of `from` in `to`.
    ///
    /// # Errors
    /// A name does not denote exactly one node, or no edges with poses connect the nodes.
    pub fn pose(&self, to: impl End, from: impl End) -> Result<Pose, Error> {
        Ok(self.0.pose(to.node(self)?, from.node(self)?)?)
    }
}
