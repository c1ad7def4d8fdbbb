//! One version of the graph. It never changes, so its readers need no lock.

use crate::Time;
use crate::element::{Edge, EdgeId, Element, Half, Id, Lists, NONE, Node, NodeId, Place};
use crate::error::Error;
use crate::last::LastChange;
use crate::names::{Named, Names, Symbol};
use crate::stored::{Attributes, stored, value};
use crate::types::Types;
use crate::value::Value;
use graph_pages::{Ids, Pages};
use graph_schema::{Kind, Schema};
use std::sync::Arc;

mod refs;

pub use refs::{EdgeRef, NodeRef, Step};

/// One version of the graph.
///
/// Queries about one element and steps to neighbours neither allocate memory nor take a lock.
#[derive(Clone, Debug)]
pub struct Snapshot {
    pub(crate) version: u64,
    pub(crate) time: Time,
    pub(crate) nodes: Pages<Node>,
    pub(crate) edges: Pages<Edge>,
    pub(crate) shape: Arc<Shape>,
    pub(crate) types: Arc<Types>,
    pub(crate) tree: Arc<innermodel::Snapshot>,
    /// Whether all frames are in one tree.
    pub(crate) is_one_tree: bool,
    /// The change that made this version.
    pub(crate) last: LastChange,
}

/// All that a change of attributes leaves as it is.
#[derive(Clone, Debug)]
pub(crate) struct Shape {
    /// Wide pages: a step of a traversal reads two of them and one at the bottom.
    pub(crate) places: Pages<Place, 7, 4>,
    pub(crate) lists: Pages<Lists, 7, 4>,
    pub(crate) names: Names,
    pub(crate) node_ids: Ids<Id>,
    pub(crate) edge_ids: Ids<Id>,
    /// The places of nodes that represent edges, by the places of these.
    pub(crate) standing: Ids<u32>,
    pub(crate) standing_count: usize,
    /// The first node of each name. The others follow in [`Place::of_name`].
    pub(crate) named: Ids<Arc<str>>,
    /// Nodes by the type that declares a key, the key, and its value.
    pub(crate) keys: Ids<(Symbol, Symbol, Arc<str>)>,
    /// By symbol of a type.
    pub(crate) of_type: Pages<OfType>,
    pub(crate) free_node: u32,
    pub(crate) free_edge: u32,
    pub(crate) node_count: usize,
    pub(crate) edge_count: usize,
    /// The first count of an id that is not used.
    pub(crate) next: u64,
    pub(crate) writer: u64,
}

/// The nodes of a type.
#[derive(Clone, Copy, Debug)]
pub(crate) struct OfType {
    pub(crate) first: u32,
    pub(crate) count: u32,
}

impl Snapshot {
    pub(crate) fn empty(schema: Arc<Schema>, writer: u64) -> Self {
        let mut names = Names::default();
        let types = Arc::new(Types::new(schema, &mut names));
        names.settle();
        Self {
            version: 1,
            time: Time::ZERO,
            nodes: Pages::new(),
            edges: Pages::new(),
            shape: Arc::new(Shape {
                places: Pages::new(),
                lists: Pages::new(),
                names,
                node_ids: Ids::new(),
                edge_ids: Ids::new(),
                standing: Ids::new(),
                standing_count: 0,
                named: Ids::new(),
                keys: Ids::new(),
                of_type: Pages::new(),
                free_node: NONE,
                free_edge: NONE,
                node_count: 0,
                edge_count: 0,
                next: 1,
                writer,
            }),
            types,
            tree: innermodel::InnerModel::new().snapshot(),
            is_one_tree: true,
            last: LastChange::default(),
        }
    }

    /// Prepares a new version for its clones.
    pub(crate) fn settle(&mut self) {
        self.nodes.settle();
        self.edges.settle();
        // A shape that others share has not changed.
        if let Some(shape) = Arc::get_mut(&mut self.shape) {
            shape.places.settle();
            shape.lists.settle();
            shape.of_type.settle();
            shape.names.settle();
        }
    }

    /// The number of the version. A later version of the same graph has a greater one.
    pub fn version(&self) -> u64 {
        self.version
    }

    /// When the version was made.
    pub fn time(&self) -> Time {
        self.time
    }

    /// The schema of the graph.
    pub fn schema(&self) -> &Arc<Schema> {
        &self.types.schema
    }

    /// The writer whose number new ids have.
    pub fn writer(&self) -> u64 {
        self.shape.writer
    }

    /// How many nodes there are.
    pub fn node_count(&self) -> usize {
        self.shape.node_count
    }

    /// How many edges there are.
    pub fn edge_count(&self) -> usize {
        self.shape.edge_count
    }

    /// The number of a name, if any element or the schema has it.
    #[inline]
    pub fn symbol(&self, name: impl Named) -> Option<Symbol> {
        name.symbol(&self.shape.names)
    }

    /// The name with a number.
    pub fn text(&self, symbol: Symbol) -> &str {
        self.shape.names.text(symbol)
    }

    #[inline]
    pub(crate) fn place(&self, node: NodeId) -> Result<&Place, Error> {
        match self.shape.places.get(node.place as usize) {
            Some(place) if place.generation == node.generation => Ok(place),
            _ => Err(Error::Removed),
        }
    }

    #[inline]
    pub(crate) fn edge_of(&self, edge: EdgeId) -> Result<&Edge, Error> {
        match self.edges.get(edge.place as usize) {
            Some(here) if here.generation == edge.generation => Ok(here),
            _ => Err(Error::Removed),
        }
    }

    pub(crate) fn node_at(&self, place: u32) -> Option<NodeId> {
        let here = self.shape.places.get(place as usize)?;
        here.generation.is_multiple_of(2).then_some(NodeId {
            place,
            generation: here.generation,
        })
    }

    pub(crate) fn edge_at(&self, place: u32) -> Option<EdgeId> {
        let here = self.edges.get(place as usize)?;
        here.generation.is_multiple_of(2).then_some(EdgeId {
            place,
            generation: here.generation,
        })
    }

    /// A node, to ask it.
    #[inline]
    pub fn node(&self, node: NodeId) -> Result<NodeRef<'_>, Error> {
        Ok(NodeRef {
            snapshot: self,
            node,
            place: self.place(node)?,
        })
    }

    /// An edge, to ask it.
    #[inline]
    pub fn edge(&self, edge: EdgeId) -> Result<EdgeRef<'_>, Error> {
        Ok(EdgeRef {
            snapshot: self,
            id: edge,
            edge: self.edge_of(edge)?,
        })
    }

    /// All nodes, in the order of their places, without those that only represent an edge.
    pub fn nodes(&self) -> impl Iterator<Item = NodeRef<'_>> {
        self.places()
            .filter(|node| self.stands_for(*node).is_none())
            .filter_map(|node| self.node(node).ok())
    }

    fn places(&self) -> impl Iterator<Item = NodeId> {
        (0..self.shape.places.len() as u32).filter_map(|at| self.node_at(at))
    }

    /// The edge that a node represents: as an end of other edges, an edge is a node.
    #[inline]
    pub fn stands_for(&self, node: NodeId) -> Option<EdgeId> {
        if self.shape.standing_count == 0 {
            return None;
        }
        self.place(node).ok()?;
        let edge = self.nodes.get(node.place as usize)?.edge;
        (edge != NONE).then(|| self.edge_at(edge)).flatten()
    }

    /// The node that represents an edge, if other edges start or end there.
    pub fn node_of(&self, edge: EdgeId) -> Option<NodeId> {
        self.edge_of(edge).ok()?;
        self.node_at(self.shape.standing.get(&edge.place)?)
    }

    /// The edges at which other edges start or end.
    pub fn promoted(&self) -> impl Iterator<Item = EdgeRef<'_>> {
        let places = (self.shape.standing_count > 0).then(|| self.places());
        let edges = places.into_iter().flatten();
        let edges = edges.filter_map(|node| self.stands_for(node));
        edges.filter_map(|edge| self.edge(edge).ok())
    }

    /// All edges, in the order of their places.
    pub fn edges(&self) -> impl Iterator<Item = EdgeRef<'_>> {
        (0..self.edges.len() as u32)
            .filter_map(|at| self.edge_at(at))
            .filter_map(|edge| self.edge(edge).ok())
    }

    /// The element with an id.
    pub fn find(&self, id: Id) -> Option<Element> {
        let node = self.shape.node_ids.get(&id);
        let node = node.and_then(|at| self.node_at(at)).map(Element::Node);
        node.or_else(|| {
            let edge = self.shape.edge_ids.get(&id)?;
            self.edge_at(edge).map(Element::Edge)
        })
    }

    /// The node with an id.
    pub fn find_node(&self, id: Id) -> Option<NodeId> {
        self.node_at(self.shape.node_ids.get(&id)?)
    }

    /// The edge with an id.
    pub fn find_edge(&self, id: Id) -> Option<EdgeId> {
        self.edge_at(self.shape.edge_ids.get(&id)?)
    }

    /// The nodes whose attribute `name` is this text.
    pub fn named(&self, name: &str) -> impl Iterator<Item = NodeId> {
        let first = self.shape.named.get(name);
        std::iter::successors(first, |at| {
            let place = self.shape.lists.get(*at as usize)?;
            Some(place.of_name.next).filter(|next| *next != NONE)
        })
        .filter_map(|at| self.node_at(at))
    }

    /// The node of `kind`, or of a type that inherits from it, whose key `attribute` has a value.
    pub fn by_key(&self, kind: impl Named, attribute: impl Named, value: &str) -> Option<NodeId> {
        let (kind, attribute) = (self.symbol(kind)?, self.symbol(attribute)?);
        let entity = self.types.entity(kind)?;
        let key = entity.keys.iter().find(|(known, _)| *known == attribute)?;
        let key = (key.1, attribute, Arc::from(value));
        let node = self.node_at(self.shape.keys.get(&key)?)?;
        self.types
            .is_a(self.place(node).ok()?.kind, kind)
            .then_some(node)
    }

    /// The nodes of exactly this type.
    pub fn of_type(&self, kind: impl Named) -> impl Iterator<Item = NodeId> {
        let list = self
            .symbol(kind)
            .and_then(|kind| self.shape.of_type.get(kind.0 as usize));
        let first = list.map(|list| list.first).filter(|at| *at != NONE);
        std::iter::successors(first, |at| {
            let place = self.shape.lists.get(*at as usize)?;
            Some(place.of_type.next).filter(|next| *next != NONE)
        })
        .filter_map(|at| self.node_at(at))
    }

    /// How many nodes of exactly this type there are.
    pub fn count_of_type(&self, kind: impl Named) -> usize {
        let list = self
            .symbol(kind)
            .and_then(|kind| self.shape.of_type.get(kind.0 as usize));
        list.map_or(0, |list| list.count as usize)
    }

    /// The nodes of a type and of all that inherit from it.
    pub fn instances(&self, kind: impl Named) -> impl Iterator<Item = NodeId> {
        self.types_below(kind)
            .flat_map(|symbol| self.of_type(symbol))
    }

    /// How many nodes of a type, and of all that inherit from it, there are.
    pub fn count_of_instances(&self, kind: impl Named) -> usize {
        let types = self.types_below(kind);
        types.map(|symbol| self.count_of_type(symbol)).sum()
    }

    fn types_below(&self, kind: impl Named) -> impl Iterator<Item = Symbol> {
        let wanted = self.symbol(kind);
        let below = wanted.map(|wanted| self.types.below(wanted));
        wanted.into_iter().chain(below.into_iter().flatten())
    }

    /// The relations whose edges are nodes of a type to others.
    pub fn relations_as(&self, kind: Symbol) -> impl Iterator<Item = Symbol> {
        self.types.relations_as(kind)
    }

    /// The nodes to which edges of a relation lead from a node.
    #[inline]
    pub fn out(&self, node: NodeId, relation: Symbol) -> impl Iterator<Item = NodeId> {
        neighbours(self.outgoing(node), relation)
    }

    /// The nodes from which edges of a relation lead to a node.
    #[inline]
    pub fn in_(&self, node: NodeId, relation: Symbol) -> impl Iterator<Item = NodeId> {
        neighbours(self.incoming(node), relation)
    }

    /// All nodes to which edges lead from a node.
    #[inline]
    pub fn successors(&self, node: NodeId) -> impl Iterator<Item = NodeId> {
        self.outgoing(node).iter().map(|half| half.node)
    }

    /// All nodes from which edges lead to a node.
    #[inline]
    pub fn predecessors(&self, node: NodeId) -> impl Iterator<Item = NodeId> {
        self.incoming(node).iter().map(|half| half.node)
    }

    #[inline]
    pub(crate) fn outgoing(&self, node: NodeId) -> &[Half] {
        self.place(node).map_or(&[], |place| place.out.all())
    }

    #[inline]
    pub(crate) fn incoming(&self, node: NodeId) -> &[Half] {
        match self.shape.lists.get(node.place as usize) {
            Some(lists) if lists.generation == node.generation => lists.in_.all(),
            _ => &[],
        }
    }

    /// The edges from a node, of a relation or of all.
    pub fn out_edges(
        &self,
        node: NodeId,
        relation: Option<Symbol>,
    ) -> impl Iterator<Item = EdgeRef<'_>> {
        self.edges_of(self.outgoing(node), relation)
    }

    /// The edges to a node, of a relation or of all.
    pub fn in_edges(
        &self,
        node: NodeId,
        relation: Option<Symbol>,
    ) -> impl Iterator<Item = EdgeRef<'_>> {
        self.edges_of(self.incoming(node), relation)
    }

    /// Steps along the edges from a node, those to it, or both, of a relation or of all. An edge from the
    /// node to itself is one step.
    #[inline]
    pub fn steps(
        &self,
        node: NodeId,
        relation: Option<Symbol>,
        [forth, back]: [bool; 2],
    ) -> impl Iterator<Item = Step<'_>> {
        let out = if forth { self.outgoing(node) } else { &[] };
        let incoming = if back { self.incoming(node) } else { &[] };
        let incoming = self.steps_of(incoming, relation, false);
        let incoming = incoming.filter(move |step| !(forth && step.node() == node));
        self.steps_of(out, relation, true).chain(incoming)
    }

    #[inline]
    fn steps_of<'s>(
        &'s self,
        halves: &'s [Half],
        relation: Option<Symbol>,
        is_forth: bool,
    ) -> impl Iterator<Item = Step<'s>> {
        let wanted = move |half: &&Half| relation.is_none_or(|wanted| wanted == half.relation);
        let halves = halves.iter().filter(wanted);
        halves.map(move |half| Step {
            snapshot: self,
            half,
            is_forth,
        })
    }

    fn edges_of<'s>(
        &'s self,
        halves: &'s [Half],
        relation: Option<Symbol>,
    ) -> impl Iterator<Item = EdgeRef<'s>> {
        self.steps_of(halves, relation, true)
            .filter_map(|step| step.edge())
    }

    #[inline]
    pub(crate) fn attributes(&self, element: Element) -> Result<&Attributes, Error> {
        match element {
            Element::Node(node) => {
                self.place(node)?;
                let node = self.nodes.get(node.place as usize);
                let node = node.ok_or(Error::Removed)?;
                if node.edge != NONE {
                    let edge = self.edges.get(node.edge as usize);
                    return Ok(&edge.ok_or(Error::Removed)?.attributes);
                }
                Ok(&node.attributes)
            }
            Element::Edge(edge) => Ok(&self.edge_of(edge)?.attributes),
        }
    }

    /// The value of an attribute of a node or an edge. If another attribute has the same value by
    /// `consistency`, and this one was set, it is converted the first time.
    #[inline]
    pub fn get(&self, element: impl Into<Element>, attribute: impl Named) -> Option<&Value> {
        let attribute = self.symbol(attribute)?;
        let element = element.into();
        let all = self.attributes(element).ok()?;
        value(all, attribute).or_else(|| self.converted(self.kind(element).ok()?, all, attribute))
    }

    /// The value that was set as this attribute: nothing if it was set as another one.
    pub fn set_as(&self, element: Element, attribute: Symbol) -> Option<&Value> {
        value(self.attributes(element).ok()?, attribute)
    }

    /// The value of an attribute that was set as another one.
    #[cold]
    fn converted<'s>(
        &'s self,
        kind: Symbol,
        all: &'s Attributes,
        wanted: Symbol,
    ) -> Option<&'s Value> {
        if !self.types.has_groups {
            return None;
        }
        let (places, declared) = self.types.attributes_of(kind)?;
        let group = places.group(wanted)?;
        let at = group.iter().position(|(symbol, _)| *symbol == wanted)?;
        let to = &declared.get(group[at].1)?.name;
        let (set, place) = group
            .iter()
            .find_map(|(symbol, place)| Some((stored(all, *symbol)?, *place)))?;
        let Kind::Block(block) = &declared.get(place)?.kind else {
            return None;
        };
        set.other(at, |value| {
            let numbers = value.numbers()?;
            Some(Value::Floats(block.converted(&numbers, to)?.into()))
        })
    }

    /// The type of a node, or the relation of an edge. `None` if it was removed.
    #[inline]
    pub fn type_of(&self, element: Element) -> Option<Symbol> {
        self.kind(element).ok()
    }

    #[inline]
    pub(crate) fn kind(&self, element: Element) -> Result<Symbol, Error> {
        match element {
            Element::Node(node) => Ok(self.place(node)?.kind),
            Element::Edge(edge) => Ok(self.edge_of(edge)?.relation),
        }
    }

    /// Whether a type of nodes is another one, or inherits from it. A relation is also what its edges
    /// are to others.
    #[inline]
    pub fn is_a(&self, kind: Symbol, wanted: Symbol) -> bool {
        self.types.is_a(kind, wanted)
    }
}

#[inline]
fn neighbours(halves: &[Half], relation: Symbol) -> impl Iterator<Item = NodeId> {
    halves
        .iter()
        .filter(move |half| half.relation == relation)
        .map(|half| half.node)
}
