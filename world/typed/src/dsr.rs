//! DSR's names for the shared world, for moving code of agents: `DsrGraph`, `Node`, `Edge`, `RtApi`, `InnerApi` and
//! `Signals`.
//!
//! New code uses the types of its schema. The differences to DSR: no agent id is chosen, a name in a text
//! stands where C++ has a type (`"robot"`, `"rt_translation"`), and a change that the schema does not allow is an error.
//! The schema is `dsr.gdsl`, or one with its relation `RT`.

mod inner;
mod signals;

use crate::error::Error;
use crate::view::End;
pub use inner::{InnerApi, Matrix, RtApi};
use property_graph::{EdgeRef, Edit, Element, NodeRef, Snapshot};
pub use property_graph::{NodeId, Value};
use rc_world_member::Member;
pub use signals::{Signal, Signals};
use std::collections::BTreeMap;
use std::sync::Arc;

const RT: &str = "RT";
const TRANSLATION: &str = "rt_translation";
const ROTATION: &str = "rt_rotation_euler_xyz";
/// It is a part of a node, not one of its attributes.
const NAME: &str = "name";

/// Attributes by their names.
pub type Attributes = BTreeMap<String, Value>;

/// A node: a copy, which [`DsrGraph::update_node`] writes back.
#[derive(Clone, Debug, PartialEq)]
pub struct Node {
    /// The node. `None` until it is inserted.
    pub id: Option<NodeId>,
    /// The type.
    pub kind: String,
    /// The name; empty for none.
    pub name: String,
    /// The attributes but for the name.
    pub attrs: Attributes,
}

impl Node {
    /// A node that is in no graph yet.
    pub fn create(kind: &str, name: &str) -> Self {
        Self {
            id: None,
            kind: kind.to_owned(),
            name: name.to_owned(),
            attrs: Attributes::new(),
        }
    }

    fn of(node: NodeRef<'_>) -> Self {
        Self {
            id: Some(node.node_id()),
            kind: node.type_name().to_owned(),
            name: node.name().to_owned(),
            attrs: copied(node.attributes()),
        }
    }
}

/// An edge: a copy, which [`DsrGraph::insert_or_assign_edge`] writes back.
#[derive(Clone, Debug, PartialEq)]
pub struct Edge {
    /// Where it starts.
    pub from: NodeId,
    /// Where it ends.
    pub to: NodeId,
    /// The type.
    pub kind: String,
    /// The attributes.
    pub attrs: Attributes,
}

impl Edge {
    /// An edge that is in no graph yet.
    pub fn create(from: NodeId, to: NodeId, kind: &str) -> Self {
        Self {
            from,
            to,
            kind: kind.to_owned(),
            attrs: Attributes::new(),
        }
    }

    fn of(edge: EdgeRef<'_>) -> Self {
        Self {
            from: edge.from(),
            to: edge.to(),
            kind: edge.type_name().to_owned(),
            attrs: copied(edge.attributes()),
        }
    }
}

/// A copy with attributes.
pub trait Attributed {
    /// Its attributes.
    fn attrs(&self) -> &Attributes;
    /// Its attributes.
    fn attrs_mut(&mut self) -> &mut Attributes;
}

macro_rules! attributed {
    ($($of:ident),*) => {
        $(impl Attributed for $of {
            fn attrs(&self) -> &Attributes {
                &self.attrs
            }

            fn attrs_mut(&mut self) -> &mut Attributes {
                &mut self.attrs
            }
        })*
    };
}

attributed!(Node, Edge);

fn copied<'s>(all: impl Iterator<Item = (&'s str, &'s Value)>) -> Attributes {
    let all = all.filter(|(name, _)| *name != NAME);
    all.map(|(name, value)| (name.to_owned(), value.clone()))
        .collect()
}

/// The world of a component under DSR's names: `DsrGraph::new(&mut ctx.g)`.
pub struct DsrGraph<'w> {
    world: &'w mut Member,
}

impl<'w> DsrGraph<'w> {
    /// The names of DSR for a world.
    pub fn new(world: &'w mut Member) -> Self {
        Self { world }
    }

    fn now(&self) -> Arc<Snapshot> {
        self.world.snapshot()
    }

    fn change(&mut self, make: impl FnOnce(&mut Edit) -> Result<(), Error>) -> Result<bool, Error> {
        crate::world::change(self.world, make).map(|_| true)
    }

    /// The node with an id or a name. `None` if there is none, or several have the name.
    pub fn get_node(&self, of: impl End) -> Option<Node> {
        let now = self.now();
        let node = of.node(&now).ok()?;
        now.node(node).ok().map(Node::of)
    }

    /// The node of the type `root`.
    pub fn get_node_root(&self) -> Option<Node> {
        self.get_nodes_by_type("root").into_iter().next()
    }

    /// All nodes.
    pub fn get_nodes(&self) -> Vec<Node> {
        self.now().nodes().map(Node::of).collect()
    }

    /// The nodes of a type.
    pub fn get_nodes_by_type(&self, kind: &str) -> Vec<Node> {
        let now = self.now();
        let nodes = now.of_type(kind);
        nodes
            .filter_map(|node| now.node(node).ok().map(Node::of))
            .collect()
    }

    /// The nodes of several types.
    pub fn get_nodes_by_types(&self, kinds: &[&str]) -> Vec<Node> {
        let all = kinds.iter();
        all.flat_map(|kind| self.get_nodes_by_type(kind)).collect()
    }

    /// The id of the node with a name.
    pub fn get_id_from_name(&self, name: &str) -> Option<NodeId> {
        name.node(&self.now()).ok()
    }

    /// The name of the node with an id.
    pub fn get_name_from_id(&self, id: NodeId) -> Option<String> {
        self.get_node(id).map(|node| node.name)
    }

    /// The attribute `level`.
    pub fn get_node_level(&self, node: &Node) -> Option<i64> {
        self.get_attrib_by_name(node, "level")?.as_i64()
    }

    /// The node above another one in the tree.
    pub fn get_parent_node(&self, node: &Node) -> Option<Node> {
        self.get_node(self.get_parent_id(node)?)
    }

    /// The id of the node above another one in the tree.
    pub fn get_parent_id(&self, node: &Node) -> Option<NodeId> {
        let now = self.now();
        let mut edges = now.in_edges(node.id?, Some(now.symbol(RT)?));
        edges.next().map(|edge| edge.from())
    }

    /// The value of an attribute of a copy. `None` if it has none.
    pub fn get_attrib_by_name<'a>(&self, of: &'a impl Attributed, name: &str) -> Option<&'a Value> {
        of.attrs().get(name)
    }

    /// Sets an attribute of a copy. [`DsrGraph::update_node`] or [`DsrGraph::insert_or_assign_edge`] writes it.
    pub fn add_or_modify_attrib_local(
        &self,
        of: &mut impl Attributed,
        name: &str,
        value: impl Into<Value>,
    ) {
        of.attrs_mut().insert(name.to_owned(), value.into());
    }

    /// Sets an attribute of a copy that it does not have yet. Returns whether it did.
    pub fn add_attrib_local(
        &self,
        of: &mut impl Attributed,
        name: &str,
        value: impl Into<Value>,
    ) -> bool {
        let is_new = !of.attrs().contains_key(name);
        if is_new {
            self.add_or_modify_attrib_local(of, name, value);
        }
        is_new
    }

    /// Sets an attribute of a copy that it has. Returns whether it did.
    pub fn modify_attrib_local(
        &self,
        of: &mut impl Attributed,
        name: &str,
        value: impl Into<Value>,
    ) -> bool {
        let is_there = of.attrs().contains_key(name);
        if is_there {
            self.add_or_modify_attrib_local(of, name, value);
        }
        is_there
    }

    /// Takes an attribute from a copy. Returns whether it had it.
    pub fn remove_attrib_local(&self, of: &mut impl Attributed, name: &str) -> bool {
        of.attrs_mut().remove(name).is_some()
    }

    /// Adds a node with the attributes of a copy, which gets its id. `None` if one of its name is there.
    ///
    /// # Errors
    /// The schema does not allow it, or the component does not write it.
    pub fn insert_node(&mut self, node: &mut Node) -> Result<Option<NodeId>, Error> {
        if !node.name.is_empty() && self.now().named(&node.name).next().is_some() {
            return Ok(None);
        }
        let mut made = None;
        self.change(|edit| {
            let new = edit.add_node(node.kind.as_str())?;
            if !node.name.is_empty() {
                edit.set(new, NAME, node.name.as_str())?;
            }
            assign(edit, new.into(), &node.attrs)?;
            made = Some(new);
            Ok(())
        })?;
        node.id = made;
        Ok(made)
    }

    /// Gives a node the attributes of a copy, in one change. False if there is no such node.
    ///
    /// # Errors
    /// Those of [`DsrGraph::insert_node`].
    pub fn update_node(&mut self, node: &Node) -> Result<bool, Error> {
        let Some(id) = self.found(node) else {
            return Ok(false);
        };
        self.change(|edit| assign(edit, id.into(), &node.attrs))
    }

    fn found(&self, node: &Node) -> Option<NodeId> {
        let now = self.now();
        let id = node.id.or_else(|| node.name.as_str().node(&now).ok())?;
        now.node(id).is_ok().then_some(id)
    }

    /// Removes a node with its edges. False if there is no such node.
    ///
    /// # Errors
    /// Those of [`DsrGraph::insert_node`].
    pub fn delete_node(&mut self, of: impl End) -> Result<bool, Error> {
        let Some(id) = self.get_node(of).and_then(|node| node.id) else {
            return Ok(false);
        };
        self.change(|edit| Ok(edit.remove_node(id)?))
    }

    /// The edge of a type between two nodes. `None` if there is none.
    pub fn get_edge(&self, from: impl End, to: impl End, kind: &str) -> Option<Edge> {
        let now = self.now();
        let (from, to) = (from.node(&now).ok()?, to.node(&now).ok()?);
        edge(&now, from, to, kind).map(Edge::of)
    }

    /// The edges of a type.
    pub fn get_edges_by_type(&self, kind: &str) -> Vec<Edge> {
        let now = self.now();
        let edges = now.edges().filter(|edge| edge.type_name() == kind);
        edges.map(Edge::of).collect()
    }

    /// The edges to a node.
    pub fn get_edges_to_id(&self, id: NodeId) -> Vec<Edge> {
        self.now().in_edges(id, None).map(Edge::of).collect()
    }

    /// The edges from a node.
    pub fn get_edges(&self, id: NodeId) -> Vec<Edge> {
        self.now().out_edges(id, None).map(Edge::of).collect()
    }

    /// The edges of a type from a node.
    pub fn get_node_edges_by_type(&self, node: &Node, kind: &str) -> Vec<Edge> {
        let now = self.now();
        let (Some(id), Some(kind)) = (node.id, now.symbol(kind)) else {
            return Vec::new();
        };
        now.out_edges(id, Some(kind)).map(Edge::of).collect()
    }

    /// Adds an edge, or gives it the attributes of a copy. False if one of its nodes is not there.
    ///
    /// # Errors
    /// Those of [`DsrGraph::insert_node`].
    pub fn insert_or_assign_edge(&mut self, edge: &Edge) -> Result<bool, Error> {
        let now = self.now();
        if now.node(edge.from).is_err() || now.node(edge.to).is_err() {
            return Ok(false);
        }
        let before = self::edge(&now, edge.from, edge.to, &edge.kind).map(|edge| edge.edge_id());
        self.change(|edit| {
            let id = match before {
                Some(id) => id,
                None => edit.add_edge(edge.kind.as_str(), edge.from, edge.to)?,
            };
            assign(edit, id.into(), &edge.attrs)
        })
    }

    /// Removes an edge. False if there is no such edge.
    ///
    /// # Errors
    /// Those of [`DsrGraph::insert_node`].
    pub fn delete_edge(&mut self, from: impl End, to: impl End, kind: &str) -> Result<bool, Error> {
        let now = self.now();
        let (Ok(from), Ok(to)) = (from.node(&now), to.node(&now)) else {
            return Ok(false);
        };
        let Some(id) = edge(&now, from, to, kind).map(|edge| edge.edge_id()) else {
            return Ok(false);
        };
        self.change(|edit| Ok(edit.remove_edge(id)?))
    }

    /// Puts a node into the frame of another one, which it has as its only parent then. False if one of them is not
    /// there.
    ///
    /// # Errors
    /// Those of [`DsrGraph::insert_node`].
    #[allow(non_snake_case, reason = "DSR's name")]
    pub fn insert_or_assign_edge_RT(
        &mut self,
        parent: &Node,
        child: impl End,
        trans: [f64; 3],
        rot: [f64; 3],
    ) -> Result<bool, Error> {
        let now = self.now();
        let (Some(parent), Ok(child)) = (self.found(parent), child.node(&now)) else {
            return Ok(false);
        };
        if now.node(child).is_err() {
            return Ok(false);
        }
        self.change(|edit| {
            let id = crate::edit::edge(edit, RT, parent, child)?;
            edit.set(id, TRANSLATION, trans)?;
            Ok(edit.set(id, ROTATION, rot)?)
        })
    }

    /// Poses of edges.
    pub fn get_rt_api(&mut self) -> RtApi<'_> {
        RtApi::new(self.world)
    }

    /// Transforms over the tree.
    pub fn get_inner_eigen_api(&self) -> InnerApi<'_> {
        InnerApi::new(self.world)
    }
}

/// The edge of a type between two nodes.
fn edge<'s>(now: &'s Snapshot, from: NodeId, to: NodeId, kind: &str) -> Option<EdgeRef<'s>> {
    let mut edges = now.out_edges(from, Some(now.symbol(kind)?));
    edges.find(|edge| edge.to() == to)
}

/// Gives an element these attributes, and no others.
fn assign(edit: &mut Edit, element: Element, attrs: &Attributes) -> Result<(), Error> {
    let now = edit.snapshot();
    let old = match element {
        Element::Node(node) => copied(now.node(node)?.attributes()),
        Element::Edge(edge) => copied(now.edge(edge)?.attributes()),
    };
    for (name, value) in attrs {
        if old.get(name) != Some(value) {
            edit.set(element, name.as_str(), value.clone())?;
        }
    }
    for name in old.keys().filter(|name| !attrs.contains_key(*name)) {
        edit.unset(element, name.as_str())?;
    }
    Ok(())
}
