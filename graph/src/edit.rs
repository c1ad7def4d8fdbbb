//! Changes, which become one new version together.

use crate::element::{
    Attributes, Edge, EdgeId, Element, Half, Halves, Id, Lists, NONE, Neighbours, Node, NodeId,
    Place,
};
use crate::error::Error;
use crate::names::{Named, Symbol};
use crate::snapshot::{OfType, Shape, Snapshot, value};
use crate::value::{MOST_BYTES, Value};
use rc_diagnostics::foreign;
use std::collections::HashSet;
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
    /// Nodes whose place in the tree of frames may be another one.
    pub(crate) moved: Vec<NodeId>,
    /// Nodes that lost an edge.
    pub(crate) bared: Vec<NodeId>,
    /// Nodes of the tree that are gone.
    pub(crate) fallen: Vec<innermodel::NodeId>,
    /// Whether a key may be another one.
    pub(crate) keyed: Vec<u32>,
    /// Values of attributes that keep their history.
    pub(crate) kept: Vec<(Element, Symbol)>,
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

    pub(crate) fn name(&mut self, name: impl Named) -> Symbol {
        if let Some(symbol) = self.next.symbol(name) {
            return symbol;
        }
        let text = name.text(&self.next);
        self.shape().names.add(&text)
    }

    /// The next id of this graph's writer.
    fn fresh(&mut self) -> Id {
        let shape = self.shape();
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

    /// The node that stands for an edge, so that other edges can start or end there. It has the type,
    /// the id and the attributes of the edge, and is there while another edge refers to it: when a
    /// change ends, one without edges is gone. The edge stays as it is.
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

    /// The end of an edge with this id: the node, or the one that stands for the edge with this id.
    pub fn end(&mut self, id: Id) -> Result<NodeId, Error> {
        match self.next.find(id) {
            Some(Element::Node(node)) => Ok(node),
            Some(Element::Edge(edge)) => self.node_of(edge),
            None => Err(Error::UnknownId(id.0)),
        }
    }

    /// The edge that a node stands for, or the node itself: which of them has the attributes.
    fn owner(&self, element: Element) -> Element {
        let edge = match element {
            Element::Node(node) => self.next.stands_for(node),
            Element::Edge(_) => None,
        };
        edge.map_or(element, Element::Edge)
    }

    /// Takes nodes away that stand for edges to which nobody refers any more.
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

    /// Adds an edge.
    pub fn add_edge(
        &mut self,
        relation: impl Named,
        from: NodeId,
        to: NodeId,
    ) -> Result<EdgeId, Error> {
        let id = self.fresh();
        self.add_edge_as(id, relation, from, to)
    }

    /// Adds an edge that another graph made, or a file.
    pub fn add_edge_as(
        &mut self,
        id: Id,
        relation: impl Named,
        from: NodeId,
        to: NodeId,
    ) -> Result<EdgeId, Error> {
        self.step()?;
        self.next.place(from)?;
        self.next.place(to)?;
        self.claim(id)?;
        let relation = self.name(relation);
        if !self.next.types.schema.open && self.next.types.relation(relation).is_none() {
            let known = self.next.types.schema.relations.iter();
            let known = known.map(|relation| relation.name.as_str());
            return Err(unknown_type("relation", self.next.text(relation), known));
        }
        let mut edge = Edge {
            id,
            attributes: None,
            generation: 0,
            relation,
            from: from.place,
            to: to.place,
        };
        let free = self.next.shape.free_edge;
        let at = if free == NONE {
            if self.next.edges.len() >= MOST_ELEMENTS {
                return Err(Error::TooMany(MOST_ELEMENTS));
            }
            self.next.edges.push(edge.clone());
            self.next.edges.len() as u32 - 1
        } else {
            let here = self.next.edges.get_mut(free as usize);
            let here = here.ok_or(Error::Removed)?;
            edge.generation = here.generation.wrapping_add(1);
            let after = here.from;
            *here = edge.clone();
            self.shape().free_edge = after;
            free
        };
        let half = |node| Half {
            node,
            edge: at,
            relation,
        };
        self.place(from.place)?.out.push(half(to));
        self.lists(to.place)?.in_.push(half(from));
        let shape = self.shape();
        shape.edge_ids.insert(id, at);
        shape.edge_count += 1;
        let edge = EdgeId {
            place: at,
            generation: edge.generation,
        };
        self.touched.push(edge.into());
        self.note_moved(relation, from, to);
        Ok(edge)
    }

    /// Notes that a node may be at another place in the tree of frames.
    fn note_moved(&mut self, relation: Symbol, from: NodeId, to: NodeId) {
        let tree = self.next.types.relation(relation).and_then(|r| r.tree);
        if let Some(tree) = tree
            && tree.pose.is_some()
        {
            let child = [from, to][tree.child];
            if self.moved.last() != Some(&child) {
                self.moved.push(child);
            }
        }
    }

    /// Removes an edge, with those that start or end at it.
    pub fn remove_edge(&mut self, edge: EdgeId) -> Result<(), Error> {
        self.next.edge_of(edge)?;
        let mut all = vec![edge];
        if self.next.shape.standing_count > 0 {
            let mut seen = HashSet::from([edge]);
            let mut at = 0;
            while let Some(node) = all.get(at).map(|edge| self.next.node_of(*edge)) {
                at += 1;
                let Some(node) = node else { continue };
                let halves = self.next.outgoing(node).iter();
                let halves = halves.chain(self.next.incoming(node));
                let edges = halves.filter_map(|half| self.next.edge_at(half.edge));
                all.extend(edges.filter(|edge| seen.insert(*edge)));
            }
        }
        let standing = all
            .iter()
            .filter_map(|edge| Some((*edge, self.next.node_of(*edge)?)));
        let standing: Vec<(EdgeId, NodeId)> = standing.collect();
        for edge in all {
            self.take_edge(edge)?;
        }
        // Now no edge leads there.
        for (edge, node) in standing {
            self.fall(edge, node)?;
        }
        Ok(())
    }

    fn take_edge(&mut self, edge: EdgeId) -> Result<(), Error> {
        self.step()?;
        let here = self.next.edge_of(edge)?;
        let (id, relation, from, to) = (here.id, here.relation, here.from, here.to);
        self.place(from)?.out.remove(edge.place);
        self.lists(to)?.in_.remove(edge.place);
        let shape = self.shape();
        shape.edge_ids.remove(&id);
        shape.edge_count -= 1;
        let free = std::mem::replace(&mut shape.free_edge, edge.place);
        let here = self.next.edges.get_mut(edge.place as usize);
        let here = here.ok_or(Error::Removed)?;
        here.generation = here.generation.wrapping_add(1);
        here.attributes = None;
        here.from = free;
        let ends = (self.next.node_at(from), self.next.node_at(to));
        if let (Some(from), Some(to)) = ends {
            self.bared.extend([from, to]);
            self.note_moved(relation, from, to);
        }
        Ok(())
    }

    /// Removes a node with its edges. If it stands for an edge, this is removed.
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

    /// Sets an attribute.
    pub fn set(
        &mut self,
        element: impl Into<Element>,
        attribute: impl Named,
        value: impl Into<Value>,
    ) -> Result<(), Error> {
        self.step()?;
        let (element, value) = (self.owner(element.into()), value.into());
        let attribute = self.name(attribute);
        self.check_value(attribute, &value)?;
        self.put(element, attribute, Some(value))
    }

    /// Sets many attributes of one element, in a time in proportion to their number. Of two with the
    /// same name, the last one counts.
    pub fn set_all<N: Named, V: Into<Value>>(
        &mut self,
        element: impl Into<Element>,
        values: impl IntoIterator<Item = (N, V)>,
    ) -> Result<(), Error> {
        let element = self.owner(element.into());
        let before = self.next.attributes(element)?.clone();
        let mut set = Vec::new();
        for (attribute, value) in values {
            self.step()?;
            let (attribute, value) = (self.name(attribute), value.into());
            self.check_value(attribute, &value)?;
            set.push((attribute, value));
        }
        if set.is_empty() {
            return Ok(());
        }
        let mut set = last_of_each(set);
        for (attribute, value) in &set {
            self.note(element, *attribute, Some(value))?;
        }
        if let Some(before) = before {
            set = last_of_each(before.iter().cloned().chain(set).collect());
        }
        *self.attributes(element)? = Some(set.into());
        self.touch(element);
        Ok(())
    }

    fn check_value(&self, attribute: Symbol, value: &Value) -> Result<(), Error> {
        if !value.is_finite() {
            return Err(Error::NotFinite(self.cleaned(attribute)));
        }
        if value.size() > MOST_BYTES && !matches!(value, Value::Text(_) | Value::Texts(_)) {
            return Err(Error::TooManyBytes(self.cleaned(attribute)));
        }
        Ok(())
    }

    /// Removes an attribute. It is no error if the element has none.
    pub fn unset(
        &mut self,
        element: impl Into<Element>,
        attribute: impl Named,
    ) -> Result<(), Error> {
        self.step()?;
        let element = self.owner(element.into());
        match self.next.symbol(attribute) {
            Some(attribute) => self.put(element, attribute, None),
            None => self.next.attributes(element).map(|_| ()),
        }
    }

    fn cleaned(&self, symbol: Symbol) -> String {
        foreign::clean(self.next.text(symbol))
    }

    fn put(
        &mut self,
        element: Element,
        attribute: Symbol,
        value: Option<Value>,
    ) -> Result<(), Error> {
        self.note(element, attribute, value.as_ref())?;
        store(self.attributes(element)?, attribute, value);
        self.touch(element);
        Ok(())
    }

    fn attributes(&mut self, element: Element) -> Result<&mut Attributes, Error> {
        let found = match element {
            Element::Node(node) => {
                let here = self.next.nodes.get_mut(node.place as usize);
                here.map(|node| &mut node.attributes)
            }
            Element::Edge(edge) => {
                let here = self.next.edges.get_mut(edge.place as usize);
                here.map(|edge| &mut edge.attributes)
            }
        };
        found.ok_or(Error::Removed)
    }

    /// Notes what else an attribute changes: names, keys, trees and histories.
    fn note(
        &mut self,
        element: Element,
        attribute: Symbol,
        value: Option<&Value>,
    ) -> Result<(), Error> {
        let types = Arc::clone(&self.next.types);
        let kind = self.next.kind(element)?;
        match element {
            Element::Node(node) => {
                if attribute == types.name {
                    self.unname(node)?;
                    if let Some(Value::Text(text)) = value {
                        self.rename(node, text)?;
                    }
                }
                let entity = types.entity(kind);
                if entity.is_some_and(|e| e.keys.iter().any(|(key, _)| *key == attribute)) {
                    self.keyed.push(node.place);
                }
                if types.has_history
                    && types
                        .of_entity(kind, attribute)
                        .is_some_and(|a| a.history.is_some())
                {
                    self.kept.push((element, attribute));
                }
            }
            Element::Edge(edge) => {
                let here = self.next.edge_of(edge)?;
                let (from, to) = (here.from, here.to);
                let ends = (self.next.node_at(from), self.next.node_at(to));
                if let (Some(from), Some(to)) = ends {
                    self.note_moved(kind, from, to);
                }
                if types.has_history
                    && types
                        .of_relation(kind, attribute)
                        .is_some_and(|a| a.history.is_some())
                {
                    self.kept.push((element, attribute));
                }
            }
        }
        Ok(())
    }

    /// Takes a node out of the list of its name.
    fn unname(&mut self, node: NodeId) -> Result<(), Error> {
        let here = self.next.nodes.get(node.place as usize);
        let attributes = &here.ok_or(Error::Removed)?.attributes;
        let Some(Value::Text(name)) = value(attributes, self.next.types.name) else {
            return Ok(());
        };
        let name = Arc::clone(name);
        let list = self.lists(node.place)?.of_name;
        if list.next != NONE {
            self.lists(list.next)?.of_name.previous = list.previous;
        }
        if list.previous == NONE {
            let named = &mut self.shape().named;
            named.remove(&*name);
            if list.next != NONE {
                named.insert(name, list.next);
            }
        } else {
            self.lists(list.previous)?.of_name.next = list.next;
        }
        self.lists(node.place)?.of_name = Neighbours::NO;
        Ok(())
    }

    /// Puts a node into the list of a name.
    fn rename(&mut self, node: NodeId, name: &Arc<str>) -> Result<(), Error> {
        let first = self.next.shape.named.get(&**name);
        self.lists(node.place)?.of_name.next = first.unwrap_or(NONE);
        let named = &mut self.shape().named;
        if let Some(first) = first {
            named.remove(&**name);
            named.insert(Arc::clone(name), node.place);
            self.lists(first)?.of_name.previous = node.place;
        } else {
            named.insert(Arc::clone(name), node.place);
        }
        Ok(())
    }
}

/// Attributes in the order of their symbols. Of several with one name, the last one stays.
fn last_of_each(mut all: Vec<(Symbol, Value)>) -> Vec<(Symbol, Value)> {
    // The sort is stable.
    all.sort_by_key(|(attribute, _)| *attribute);
    let mut kept: Vec<(Symbol, Value)> = Vec::with_capacity(all.len());
    for entry in all {
        match kept.last_mut() {
            Some(last) if last.0 == entry.0 => *last = entry,
            _ => kept.push(entry),
        }
    }
    kept
}

/// Sets or removes one of the attributes. They stay in the order of their symbols.
fn store(attributes: &mut Attributes, attribute: Symbol, value: Option<Value>) {
    let old = attributes.as_deref().unwrap_or_default();
    let at = old.iter().position(|(known, _)| *known >= attribute);
    let at = at.unwrap_or(old.len());
    let is_there = old.get(at).is_some_and(|(known, _)| *known == attribute);
    if is_there && let Some(value) = value {
        // The usual case: one value is another one.
        if let Some(all) = attributes.as_mut() {
            Arc::make_mut(all)[at].1 = value;
        }
        return;
    }
    let rest = &old[at + usize::from(is_there)..];
    let new = value.map(|value| (attribute, value));
    let all: Arc<[_]> = old[..at]
        .iter()
        .cloned()
        .chain(new)
        .chain(rest.iter().cloned())
        .collect();
    *attributes = (!all.is_empty()).then_some(all);
}

fn unknown_type<'k>(what: &'static str, name: &str, known: impl Iterator<Item = &'k str>) -> Error {
    Error::UnknownType {
        what,
        name: foreign::clean(name),
        nearest: rc_diagnostics::nearest(name, known).map(str::to_owned),
    }
}
