//! Changes, which become one new version together.

mod attributes;
mod edges;

use crate::element::{EdgeId, Element, Halves, Id, Lists, NONE, Neighbours, Node, NodeId, Place};
use crate::error::Error;
use crate::names::{Named, Symbol};
use crate::snapshot::{OfType, Shape, Snapshot};
use crate::value::Value;
use rc_diagnostics::foreign;
use std::sync::Arc;

/// How many steps a change has at most.
pub const MOST_STEPS: usize = 1 << 22;
/// How many nodes a graph has at most, and how many edges.
pub const MOST_ELEMENTS: usize = 1 << 28;

/// Changes of a graph. Readers see all of them at once, or none.
#[derive(Debug)]
pub struct Edit {
    pub(crate) next: Snapshot,
    /// Elements that were added or changed, some of them several times.
    pub(crate) touched: Vec<Element>,
    /// Nodes whose place in the tree of frames may have changed.
    pub(crate) moved: Vec<NodeId>,
    /// Nodes that lost an edge.
    pub(crate) bared: Vec<NodeId>,
    /// Removed nodes of the tree.
    pub(crate) fallen: Vec<innermodel::NodeId>,
    /// Whether a key may have changed.
    pub(crate) keyed: Vec<u32>,
    /// Values of attributes that keep their history.
    pub(crate) kept: Vec<(Element, Symbol)>,
    /// Memory for the attributes of one element.
    set: Vec<(Symbol, Value)>,
    /// New ids count from this number on, at least.
    first_id: u64,
    steps: usize,
}

impl Edit {
    pub(crate) fn new(next: Snapshot) -> Self {
        Self {
            next,
            touched: Vec::new(),
            moved: Vec::new(),
            bared: Vec::new(),
            fallen: Vec::new(),
            keyed: Vec::new(),
            kept: Vec::new(),
            set: Vec::new(),
            first_id: 0,
            steps: 0,
        }
    }

    /// The graph with the changes made so far. Keys are those from before the change.
    pub fn snapshot(&self) -> &Snapshot {
        &self.next
    }

    fn shape(&mut self) -> &mut Shape {
        Arc::make_mut(&mut self.next.shape)
    }

    fn step(&mut self) -> Result<(), Error> {
        self.steps += 1;
        if self.steps > MOST_STEPS {
            return Err(Error::TooLarge(MOST_STEPS));
        }
        Ok(())
    }

    fn touch(&mut self, element: Element) {
        // Setting attributes of one element in turn is usual.
        if self.touched.last() != Some(&element) {
            self.touched.push(element);
        }
    }

    /// The number of the name of a type or of an attribute, for many elements that have it. A new name is
    /// added.
    pub fn name(&mut self, name: impl Named) -> Symbol {
        if let Some(symbol) = self.next.symbol(name) {
            return symbol;
        }
        let text = name.text(|symbol| self.next.text(symbol).to_owned());
        self.shape().names.add(&text)
    }

    /// Makes the ids that follow count from this number on, unless they do already.
    pub fn count_ids_from(&mut self, first: u64) {
        self.first_id = self.first_id.max(first);
    }

    /// The next id of this graph's writer.
    fn fresh(&mut self) -> Id {
        let first = self.first_id;
        let shape = self.shape();
        shape.next = shape.next.max(first);
        // A fork may have made ids with this writer before.
        loop {
            let id = Id::new(shape.writer, shape.next);
            shape.next = shape.next.saturating_add(1);
            let is_used = shape.node_ids.get(&id).is_some() || shape.edge_ids.get(&id).is_some();
            if !is_used || shape.next == u64::MAX {
                return id;
            }
        }
    }

    fn claim(&mut self, id: Id) -> Result<(), Error> {
        let shape = &self.next.shape;
        if shape.node_ids.get(&id).is_some() || shape.edge_ids.get(&id).is_some() {
            return Err(Error::DuplicateId(id.0));
        }
        let shape = self.shape();
        if id.writer() == shape.writer && id.count() >= shape.next {
            shape.next = id.count().saturating_add(1);
        }
        Ok(())
    }

    /// Adds a node.
    pub fn add_node(&mut self, kind: impl Named) -> Result<NodeId, Error> {
        let id = self.fresh();
        self.add_node_as(id, kind)
    }

    /// Adds a node that another graph made, or a file.
    pub fn add_node_as(&mut self, id: Id, kind: impl Named) -> Result<NodeId, Error> {
        self.step()?;
        self.claim(id)?;
        let kind = self.name(kind);
        if !self.next.types.schema.open && self.next.types.entity(kind).is_none() {
            let known = self.next.types.schema.entities.iter();
            let known = known.map(|entity| entity.name.as_str());
            return Err(unknown_type("entity", self.next.text(kind), known));
        }
        let node = Node {
            id,
            attributes: None,
            frame: None,
            edge: NONE,
        };
        let first = self.list(kind)?.first;
        let node = self.settle(node, kind, first)?;
        let at = node.place;
        if first != NONE {
            self.lists(first)?.of_type.previous = at;
        }
        let list = self.list(kind)?;
        list.first = at;
        list.count += 1;
        let shape = self.shape();
        shape.node_ids.insert(id, at);
        shape.node_count += 1;
        self.touched.push(node.into());
        Ok(node)
    }

    /// Gives a node a place, in front of `next` in the list of its type.
    fn settle(&mut self, node: Node, kind: Symbol, next: u32) -> Result<NodeId, Error> {
        let mut place = Place {
            generation: 0,
            kind,
            out: Halves::NO,
        };
        let mut lists = Lists {
            generation: 0,
            in_: Halves::NO,
            of_type: Neighbours {
                previous: NONE,
                next,
            },
            of_name: Neighbours::NO,
        };
        let free = self.next.shape.free_node;
        let at = if free == NONE {
            let shape = self.shape();
            if shape.places.len() >= MOST_ELEMENTS {
                return Err(Error::TooMany(MOST_ELEMENTS));
            }
            shape.places.push(place.clone());
            shape.lists.push(lists);
            self.next.nodes.push(node);
            self.next.nodes.len() as u32 - 1
        } else {
            let here = self.place(free)?;
            place.generation = here.generation.wrapping_add(1);
            *here = place.clone();
            lists.generation = place.generation;
            let here = std::mem::replace(self.lists(free)?, lists);
            self.shape().free_node = here.of_type.next;
            if let Some(slot) = self.next.nodes.get_mut(free as usize) {
                *slot = node;
            }
            free
        };
        Ok(NodeId {
            place: at,
            generation: place.generation,
        })
    }

    /// The node that represents an edge, so that other edges can start or end there. It has the
    /// type, the id and the attributes of the edge, and exists while another edge refers to it: a
    /// node without edges is removed at the end of a change. The edge stays as it is.
    pub fn node_of(&mut self, edge: EdgeId) -> Result<NodeId, Error> {
        self.step()?;
        let here = self.next.edge_of(edge)?;
        let (id, relation) = (here.id, here.relation);
        if let Some(known) = self.next.node_of(edge) {
            return Ok(known);
        }
        let node = Node {
            id,
            attributes: None,
            frame: None,
            edge: edge.place,
        };
        let node = self.settle(node, relation, NONE)?;
        let shape = self.shape();
        shape.standing.insert(edge.place, node.place);
        shape.standing_count += 1;
        self.bared.push(node);
        Ok(node)
    }

    /// The end of an edge with this id: the node, or the one that represents the edge with this id.
    pub fn end(&mut self, id: Id) -> Result<NodeId, Error> {
        match self.next.find(id) {
            Some(Element::Node(node)) => Ok(node),
            Some(Element::Edge(edge)) => self.node_of(edge),
            None => Err(Error::UnknownId(id.0)),
        }
    }

    /// The edge that a node represents, or the node itself: the element that has the attributes.
    fn owner(&self, element: Element) -> Element {
        let edge = match element {
            Element::Node(node) => self.next.stands_for(node),
            Element::Edge(_) => None,
        };
        edge.map_or(element, Element::Edge)
    }

    /// Removes nodes that represent edges to which no other edge refers any more.
    pub(crate) fn demote(&mut self) -> Result<(), Error> {
        if self.next.shape.standing_count == 0 {
            return Ok(());
        }
        for at in 0..self.bared.len() {
            let node = self.bared[at];
            let Some(edge) = self.next.stands_for(node) else {
                continue;
            };
            let is_free = self.next.outgoing(node).is_empty();
            if is_free && self.next.incoming(node).is_empty() {
                self.fall(edge, node)?;
            }
        }
        Ok(())
    }

    /// Takes the node of an edge away, which has no edges.
    fn fall(&mut self, edge: EdgeId, node: NodeId) -> Result<(), Error> {
        let shape = self.shape();
        shape.standing.remove(&edge.place);
        shape.standing_count -= 1;
        self.vacate(node)
    }

    fn place(&mut self, at: u32) -> Result<&mut Place, Error> {
        let place = self.shape().places.get_mut(at as usize);
        place.ok_or(Error::Removed)
    }

    fn lists(&mut self, at: u32) -> Result<&mut Lists, Error> {
        let lists = self.shape().lists.get_mut(at as usize);
        lists.ok_or(Error::Removed)
    }

    /// The list of the nodes of a type.
    fn list(&mut self, kind: Symbol) -> Result<&mut OfType, Error> {
        let lists = &mut self.shape().of_type;
        while lists.len() <= kind.0 as usize {
            lists.push(OfType {
                first: NONE,
                count: 0,
            });
        }
        lists.get_mut(kind.0 as usize).ok_or(Error::Removed)
    }

    /// Removes a node with its edges. If it represents an edge, this edge is removed.
    pub fn remove_node(&mut self, node: NodeId) -> Result<(), Error> {
        self.step()?;
        if let Some(edge) = self.next.stands_for(node) {
            return self.remove_edge(edge);
        }
        let place = self.next.place(node)?;
        let halves = place.out.all().iter().chain(self.next.incoming(node));
        let edges: Vec<u32> = halves.map(|half| half.edge).collect();
        // From the last one, so that those of a hub do not move up each time.
        for edge in edges.into_iter().rev() {
            // An edge from a node to itself is on both sides.
            if let Some(edge) = self.next.edge_at(edge) {
                self.remove_edge(edge)?;
            }
        }
        self.unname(node)?;
        let place = self.next.place(node)?;
        let kind = place.kind;
        let list = self.lists(node.place)?.of_type;
        match list.previous {
            NONE => self.list(kind)?.first = list.next,
            before => self.lists(before)?.of_type.next = list.next,
        }
        if list.next != NONE {
            self.lists(list.next)?.of_type.previous = list.previous;
        }
        self.list(kind)?.count -= 1;
        self.keyed.push(node.place);
        let id = self.next.nodes.get(node.place as usize).map(|node| node.id);
        let shape = self.shape();
        shape.node_ids.remove(&id.unwrap_or_default());
        shape.node_count -= 1;
        self.vacate(node)
    }

    /// Frees the place of a node without edges, which is in no list.
    fn vacate(&mut self, node: NodeId) -> Result<(), Error> {
        let gone = self.next.nodes.get_mut(node.place as usize);
        let gone = gone.ok_or(Error::Removed)?;
        gone.attributes = None;
        gone.edge = NONE;
        let frame = gone.frame.take();
        self.fallen.extend(frame);
        let shape = self.shape();
        let free = std::mem::replace(&mut shape.free_node, node.place);
        let place = self.place(node.place)?;
        place.generation = place.generation.wrapping_add(1);
        let lists = self.lists(node.place)?;
        lists.generation = lists.generation.wrapping_add(1);
        lists.of_type = Neighbours {
            previous: NONE,
            next: free,
        };
        Ok(())
    }
}

fn unknown_type<'k>(what: &'static str, name: &str, known: impl Iterator<Item = &'k str>) -> Error {
    Error::UnknownType {
        what,
        name: foreign::clean(name),
        nearest: rc_diagnostics::nearest(name, known).map(str::to_owned),
    }
}
