//! Typed traversals with Gremlin's words. No step allocates memory.

use property_graph::{Named, NodeId, Snapshot, Symbol, Value};

/// Names a node of a traverser, to compare with later or to go back to: 0 to 3.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Mark(pub usize);

/// The place of a traversal in the graph: its present node, and the nodes that it has marked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Traverser {
    /// The present node.
    pub node: NodeId,
    marks: [Option<NodeId>; Self::MARKS],
}

impl Traverser {
    /// How many marks there are.
    pub const MARKS: usize = 4;

    /// Moves to another node and keeps the marks.
    fn at(self, node: NodeId) -> Self {
        Self {
            node,
            marks: self.marks,
        }
    }

    /// The node with a mark.
    pub fn marked(&self, mark: Mark) -> Option<NodeId> {
        self.marks.get(mark.0).copied().flatten()
    }
}

/// The steps so far, and the traversers that have taken them.
#[derive(Clone, Debug)]
pub struct Traversal<'s, I> {
    graph: &'s Snapshot,
    traversers: I,
}

/// Starts at nodes.
pub fn traverse(
    graph: &Snapshot,
    nodes: impl IntoIterator<Item = NodeId>,
) -> Traversal<'_, impl Iterator<Item = Traverser>> {
    let traversers = nodes.into_iter().map(|node| Traverser {
        node,
        marks: [None; Traverser::MARKS],
    });
    Traversal { graph, traversers }
}

impl<'s, I: Iterator<Item = Traverser>> Traversal<'s, I> {
    fn then<J: Iterator<Item = Traverser>>(
        self,
        next: impl FnOnce(I, &'s Snapshot) -> J,
    ) -> Traversal<'s, J> {
        Traversal {
            traversers: next(self.traversers, self.graph),
            graph: self.graph,
        }
    }

    /// The traversal in a type of its own, so that steps can be added that are known only at run
    /// time. It allocates once.
    pub fn boxed(self) -> Traversal<'s, Box<dyn Iterator<Item = Traverser> + 's>>
    where
        I: 's,
    {
        self.then(|traversers, _| Box::new(traversers) as _)
    }

    /// Along edges of a relation.
    pub fn out(self, relation: impl Named) -> Traversal<'s, impl Iterator<Item = Traverser>> {
        let relation = self.graph.symbol(relation);
        self.then(move |traversers, graph| {
            traversers.flat_map(move |traverser| {
                let next = relation.map(|relation| graph.out(traverser.node, relation));
                next.into_iter()
                    .flatten()
                    .map(move |node| traverser.at(node))
            })
        })
    }

    /// Against edges of a relation.
    pub fn in_(self, relation: impl Named) -> Traversal<'s, impl Iterator<Item = Traverser>> {
        let relation = self.graph.symbol(relation);
        self.then(move |traversers, graph| {
            traversers.flat_map(move |traverser| {
                let next = relation.map(|relation| graph.in_(traverser.node, relation));
                next.into_iter()
                    .flatten()
                    .map(move |node| traverser.at(node))
            })
        })
    }

    /// Only nodes of a type, or of one that inherits from it.
    pub fn has_type(self, kind: impl Named) -> Traversal<'s, impl Iterator<Item = Traverser>> {
        let wanted = self.graph.symbol(kind);
        self.filter(move |graph, traverser| {
            let kind = graph.node(traverser.node).map(|node| node.kind()).ok();
            kind.zip(wanted)
                .is_some_and(|(kind, wanted)| graph.is_a(kind, wanted))
        })
    }

    /// Only nodes with a value of an attribute.
    pub fn has(
        self,
        attribute: impl Named,
        value: impl Into<Value>,
    ) -> Traversal<'s, impl Iterator<Item = Traverser>> {
        let (attribute, value) = (self.graph.symbol(attribute), value.into());
        self.filter(move |graph, traverser| {
            attribute.is_some_and(|a: Symbol| graph.get(traverser.node, a) == Some(&value))
        })
    }

    /// Only traversers that a test accepts.
    pub fn filter(
        self,
        mut test: impl FnMut(&Snapshot, &Traverser) -> bool,
    ) -> Traversal<'s, impl Iterator<Item = Traverser>> {
        self.then(move |traversers, graph| {
            traversers.filter(move |traverser| test(graph, traverser))
        })
    }

    /// Marks the present node.
    pub fn as_(self, mark: Mark) -> Traversal<'s, impl Iterator<Item = Traverser>> {
        self.then(move |traversers, _| {
            traversers.map(move |mut traverser| {
                if let Some(slot) = traverser.marks.get_mut(mark.0) {
                    *slot = Some(traverser.node);
                }
                traverser
            })
        })
    }

    /// Only traversers that have come back to a marked node.
    pub fn where_eq(self, mark: Mark) -> Traversal<'s, impl Iterator<Item = Traverser>> {
        self.filter(move |_, traverser| traverser.marked(mark) == Some(traverser.node))
    }

    /// Goes back to a marked node. Traversers without the mark end.
    pub fn select(self, mark: Mark) -> Traversal<'s, impl Iterator<Item = Traverser>> {
        self.then(move |traversers, _| {
            traversers.filter_map(move |traverser| {
                let node = traverser.marked(mark)?;
                Some(traverser.at(node))
            })
        })
    }

    /// Follows the first edge of a relation until a test holds. A traverser that ends before, or
    /// that has as many steps as the graph has nodes, is left out.
    pub fn repeat_until(
        self,
        relation: impl Named,
        mut until: impl FnMut(&Snapshot, NodeId) -> bool,
    ) -> Traversal<'s, impl Iterator<Item = Traverser>> {
        let relation = self.graph.symbol(relation);
        self.then(move |traversers, graph| {
            traversers.filter_map(move |traverser| {
                let mut node = traverser.node;
                for _ in 0..=graph.node_count() {
                    if until(graph, node) {
                        return Some(traverser.at(node));
                    }
                    node = graph.out(node, relation?).next()?;
                }
                None
            })
        })
    }

    /// The nodes.
    pub fn nodes(self) -> impl Iterator<Item = NodeId> {
        self.traversers.map(|traverser| traverser.node)
    }

    /// The traversers.
    pub fn traversers(self) -> I {
        self.traversers
    }

    /// The values of an attribute; nodes without it are left out.
    pub fn values(self, attribute: impl Named) -> impl Iterator<Item = &'s Value> {
        let (graph, attribute) = (self.graph, self.graph.symbol(attribute));
        let traversers = self.traversers;
        traversers.filter_map(move |traverser| graph.get(traverser.node, attribute?))
    }

    /// Computes over all traversers.
    pub fn fold<T>(self, start: T, mut next: impl FnMut(T, &Snapshot, &Traverser) -> T) -> T {
        let graph = self.graph;
        self.traversers
            .fold(start, |all, traverser| next(all, graph, &traverser))
    }

    /// How many traversers there are.
    pub fn count(self) -> usize {
        self.traversers.count()
    }
}
