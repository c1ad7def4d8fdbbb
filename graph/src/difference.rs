//! Differences between two versions.

use crate::edit::Edit;
use crate::element::{EdgeId, Element, Id, NodeId};
use crate::names::Symbol;
use crate::snapshot::Snapshot;
use crate::stored::Attributes;
use std::sync::Arc;

/// One difference.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Change {
    /// An edge was removed.
    EdgeRemoved(EdgeId, Id),
    /// A node was removed.
    NodeRemoved(NodeId, Id),
    /// A node is new.
    NodeAdded(NodeId),
    /// An edge is new. Its nodes come before it.
    EdgeAdded(EdgeId),
    /// An attribute of an element has another value, or none now.
    Attribute(Element, Symbol),
}

impl Snapshot {
    /// The differences from an older version of the same graph. The time depends on the changes,
    /// not on the size of the graph. Attributes of new elements are not listed separately.
    pub fn since(&self, older: &Self) -> Vec<Change> {
        match self.touched_since(older) {
            Some(touched) => self.attributes_of(older, touched),
            None => self.compared(older),
        }
    }

    fn compared(&self, older: &Self) -> Vec<Change> {
        let (mut nodes, mut edges) = (Vec::new(), Vec::new());
        self.nodes.differences(&older.nodes, &mut |at| {
            if !self.is_same_node(older, at) {
                nodes.push(at as u32);
            }
        });
        self.edges.differences(&older.edges, &mut |at| {
            edges.push(at as u32);
        });
        let mut removed = Vec::new();
        let mut added = Vec::new();
        let mut changed = Vec::new();
        let mut new_edges = Vec::new();
        for at in edges {
            let (new, old) = (self.edge_at(at), older.edge_at(at));
            if new == old {
                if let Some(edge) = new {
                    self.attributes_since(older, edge.into(), &mut changed);
                }
                continue;
            }
            let gone = old.and_then(|old| Some((old, older.edges.get(at as usize)?.id)));
            removed.extend(gone.map(|(edge, id)| Change::EdgeRemoved(edge, id)));
            new_edges.extend(new.map(Change::EdgeAdded));
        }
        for at in nodes {
            // A node that represents an edge is not listed.
            let own = |of: &Self| of.node_at(at).filter(|node| of.stands_for(*node).is_none());
            let (new, old) = (own(self), own(older));
            if new == old {
                if let Some(node) = new {
                    self.attributes_since(older, node.into(), &mut changed);
                }
                continue;
            }
            let gone = old.and_then(|old| Some((old, older.nodes.get(at as usize)?.id)));
            removed.extend(gone.map(|(node, id)| Change::NodeRemoved(node, id)));
            added.extend(new.map(Change::NodeAdded));
        }
        removed.extend(added);
        removed.extend(new_edges);
        removed.extend(changed);
        removed
    }

    /// Whether one node with one set of attributes is at a place in both versions. A page of the vector
    /// has other nodes, too.
    fn is_same_node(&self, older: &Self, at: usize) -> bool {
        let (Some(new), Some(old)) = (self.nodes.get(at), older.nodes.get(at)) else {
            return false;
        };
        let generation = |of: &Self| of.shape.places.get(at).map(|place| place.generation);
        new.id == old.id
            && new.edge == old.edge
            && is_same(&new.attributes, &old.attributes)
            && generation(self) == generation(older)
    }

    /// The differences of the attributes of these elements, those of edges first.
    fn attributes_of(&self, older: &Self, touched: &[Element]) -> Vec<Change> {
        let mut changes = Vec::with_capacity(touched.len());
        let is_edge = |element: &&Element| matches!(element, Element::Edge(_));
        let nodes = touched.iter().filter(|element| !is_edge(element));
        for element in touched.iter().filter(is_edge).chain(nodes) {
            self.attributes_since(older, *element, &mut changes);
        }
        changes
    }

    fn attributes_since(&self, older: &Self, element: Element, changes: &mut Vec<Change>) {
        let (Ok(new), Ok(old)) = (self.attributes(element), older.attributes(element)) else {
            return;
        };
        if is_same(new, old) {
            return;
        }
        let first = changes.len();
        let (mut new, mut old) = (
            new.as_deref().unwrap_or_default(),
            old.as_deref().unwrap_or_default(),
        );
        // Both are in the order of their symbols.
        loop {
            let symbol = match (new, old) {
                ([a, later @ ..], [b, earlier @ ..]) if a.0 == b.0 => {
                    (new, old) = (later, earlier);
                    if a.1.value() == b.1.value() {
                        continue;
                    }
                    a.0
                }
                ([a, later @ ..], others) if others.first().is_none_or(|b| a.0 < b.0) => {
                    new = later;
                    a.0
                }
                (_, [b, earlier @ ..]) => {
                    old = earlier;
                    b.0
                }
                _ => break,
            };
            changes.push(Change::Attribute(element, symbol));
        }
        if self.types.has_groups {
            self.add_groups(element, first, changes);
        }
    }

    /// Adds the attributes that have one value with a changed one: they have another value, too.
    fn add_groups(&self, element: Element, first: usize, changes: &mut Vec<Change>) {
        let Ok(kind) = self.kind(element) else {
            return;
        };
        let mut all: Vec<Symbol> = Vec::new();
        for change in changes.drain(first..) {
            let Change::Attribute(_, symbol) = change else {
                continue;
            };
            let group = self.types.group(kind, symbol).unwrap_or_default();
            all.extend(group.iter().map(|(symbol, _)| *symbol).chain([symbol]));
        }
        all.sort_unstable();
        all.dedup();
        let all = all.into_iter();
        changes.extend(all.map(|symbol| Change::Attribute(element, symbol)));
    }
}

impl Edit {
    /// The differences from the version in which the change began, or from another one.
    pub fn since(&mut self, older: &Snapshot) -> Vec<Change> {
        match self.touched_since(older).map(<[Element]>::to_vec) {
            Some(touched) => self.next.attributes_of(older, &touched),
            None => self.next.compared(older),
        }
    }
}

/// Whether two versions share the attributes of an element.
fn is_same(new: &Attributes, old: &Attributes) -> bool {
    match (new, old) {
        (Some(new), Some(old)) => Arc::ptr_eq(new, old),
        (None, None) => true,
        _ => false,
    }
}
