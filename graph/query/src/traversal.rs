//! Typed traversals with Gremlin's words. No step allocates memory.

use property_graph::{Named, NodeId, Snapshot, Symbol, Value};

/// Names a node on the way, to compare with later or to go back to: 0 to 3.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Mark(pub usize);

/// Somebody on the way: where they are, and what they marked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Walker {
    /// The present node.
    pub node: NodeId,
    marks: [Option<NodeId>; Self::MARKS],
}

impl Walker {
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

/// The ways that were taken so far.
#[derive(Clone, Debug)]
pub struct Traversal<'s, I> {
    graph: &'s Snapshot,
    walkers: I,
}

/// Starts at nodes.
pub fn traverse(
    graph: &Snapshot,
    nodes: impl IntoIterator<Item = NodeId>,
) -> Traversal<'_, impl Iterator<Item = Walker>> {
    let walkers = nodes.into_iter().map(|node| Walker {
        node,
        marks: [None; Walker::MARKS],
    });
    Traversal { graph, walkers }
}

impl<'s, I: Iterator<Item = Walker>> Traversal<'s, I> {
    fn then<J: Iterator<Item = Walker>>(
        self,
        next: impl FnOnce(I, &'s Snapshot) -> J,
    ) -> Traversal<'s, J> {
        Traversal {
            walkers: next(self.walkers, self.graph),
            graph: self.graph,
        }
    }

    /// The same in a type of its own, so that steps can follow that are known at run time only. It
    /// allocates once.
    pub fn boxed(self) -> Traversal<'s, Box<dyn Iterator<Item = Walker> + 's>>
    where
        I: 's,
    {
        self.then(|walkers, _| Box::new(walkers) as _)
    }

    /// Along edges of a relation.
    pub fn out(self, relation: impl Named) -> Traversal<'s, impl Iterator<Item = Walker>> {
        let relation = self.graph.symbol(relation);
        self.then(move |walkers, graph| {
            walkers.flat_map(move |walker| {
                let next = relation.map(|relation| graph.out(walker.node, relation));
                next.into_iter().flatten().map(move |node| walker.at(node))
            })
        })
    }

    /// Against edges of a relation.
    pub fn in_(self, relation: impl Named) -> Traversal<'s, impl Iterator<Item = Walker>> {
        let relation = self.graph.symbol(relation);
        self.then(move |walkers, graph| {
            walkers.flat_map(move |walker| {
                let next = relation.map(|relation| graph.in_(walker.node, relation));
                next.into_iter().flatten().map(move |node| walker.at(node))
            })
        })
    }

    /// Only nodes of a type, or of one that inherits from it.
    pub fn has_type(self, kind: impl Named) -> Traversal<'s, impl Iterator<Item = Walker>> {
        let wanted = self.graph.symbol(kind);
        self.filter(move |graph, walker| {
            let kind = graph.node(walker.node).map(|node| node.kind()).ok();
            kind.zip(wanted)
                .is_some_and(|(kind, wanted)| graph.is_a(kind, wanted))
        })
    }

    /// Only nodes with a value of an attribute.
    pub fn has(
        self,
        attribute: impl Named,
        value: impl Into<Value>,
    ) -> Traversal<'s, impl Iterator<Item = Walker>> {
        let (attribute, value) = (self.graph.symbol(attribute), value.into());
        self.filter(move |graph, walker| {
            attribute.is_some_and(|a: Symbol| graph.get(walker.node, a) == Some(&value))
        })
    }

    /// Only ways that a test accepts.
    pub fn filter(
        self,
        mut test: impl FnMut(&Snapshot, &Walker) -> bool,
    ) -> Traversal<'s, impl Iterator<Item = Walker>> {
        self.then(move |walkers, graph| walkers.filter(move |walker| test(graph, walker)))
    }

    /// Marks the present node.
    pub fn as_(self, mark: Mark) -> Traversal<'s, impl Iterator<Item = Walker>> {
        self.then(move |walkers, _| {
            walkers.map(move |mut walker| {
                if let Some(slot) = walker.marks.get_mut(mark.0) {
                    *slot = Some(walker.node);
                }
                walker
            })
        })
    }

    /// Only ways that have come back to a marked node.
    pub fn where_eq(self, mark: Mark) -> Traversal<'s, impl Iterator<Item = Walker>> {
        self.filter(move |_, walker| walker.marked(mark) == Some(walker.node))
    }

    /// Goes back to a marked node. Ways without the mark end.
    pub fn select(self, mark: Mark) -> Traversal<'s, impl Iterator<Item = Walker>> {
        self.then(move |walkers, _| {
            walkers.filter_map(move |walker| {
                let node = walker.marked(mark)?;
                Some(walker.at(node))
            })
        })
    }

    /// Goes along the first edge of a relation until a test holds. A way that ends before, or that
    /// has as many steps as the graph has nodes, is left out.
    pub fn repeat_until(
        self,
        relation: impl Named,
        mut until: impl FnMut(&Snapshot, NodeId) -> bool,
    ) -> Traversal<'s, impl Iterator<Item = Walker>> {
        let relation = self.graph.symbol(relation);
        self.then(move |walkers, graph| {
            walkers.filter_map(move |walker| {
                let mut node = walker.node;
                for _ in 0..=graph.node_count() {
                    if until(graph, node) {
                        return Some(walker.at(node));
                    }
                    node = graph.out(node, relation?).next()?;
                }
                None
            })
        })
    }

    /// The nodes.
    pub fn nodes(self) -> impl Iterator<Item = NodeId> {
        self.walkers.map(|walker| walker.node)
    }

    /// The ways.
    pub fn walkers(self) -> I {
        self.walkers
    }

    /// The values of an attribute; nodes without it are left out.
    pub fn values(self, attribute: impl Named) -> impl Iterator<Item = &'s Value> {
        let (graph, attribute) = (self.graph, self.graph.symbol(attribute));
        let walkers = self.walkers;
        walkers.filter_map(move |walker| graph.get(walker.node, attribute?))
    }

    /// Computes over all ways.
    pub fn fold<T>(self, start: T, mut next: impl FnMut(T, &Snapshot, &Walker) -> T) -> T {
        let graph = self.graph;
        self.walkers
            .fold(start, |all, walker| next(all, graph, &walker))
    }

    /// How many ways there are.
    pub fn count(self) -> usize {
        self.walkers.count()
    }
}
