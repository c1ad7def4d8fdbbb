//! Composites: a node with its parts, over the same edges (MM05 of `RobMoSys` D3.2).

use crate::edit::Edit;
use crate::element::NodeId;
use crate::error::Error;
use crate::names::{Named, Symbol};
use graph_schema::COMPOSED_BY;
use std::collections::HashSet;

impl Edit {
    /// Adds a node with these edges, and with the parts that compose its type, or one that it
    /// inherits from: each part is the node of its type with the same edges, or a new one, and an
    /// edge `composed_by` leads to it. Existing nodes are used, also for the node itself, so that
    /// the graph is the same whatever it had before. Without edges, the node and all parts are new.
    pub fn compose<R: Named>(
        &mut self,
        kind: impl Named,
        ends: &[(R, NodeId)],
    ) -> Result<NodeId, Error> {
        let kind = self.name(kind);
        let mut edges = Vec::with_capacity(ends.len());
        for (relation, end) in ends {
            edges.push((self.name(*relation), *end));
        }
        let whole = self.with_edges(kind, &edges)?;
        // A composite may have composites as parts. The language refuses circles of them.
        let mut left = vec![(whole, kind)];
        let mut rounds = 0;
        // With edges, a type has one node, whatever has it as a part.
        let mut seen = HashSet::from([whole]);
        while let Some((whole, kind)) = left.pop() {
            rounds += 1;
            if rounds > crate::edit::MOST_STEPS {
                return Err(Error::TooLarge(crate::edit::MOST_STEPS));
            }
            let schema = std::sync::Arc::clone(self.next.schema());
            let own = self.next.text(kind).to_owned();
            let types = schema.ancestry(&own).filter_map(|name| schema.entity(name));
            for part in types.flat_map(|entity| &entity.parts) {
                let kind = self.name(part);
                let node = self.with_edges(kind, &edges)?;
                let composed_by = self.name(COMPOSED_BY);
                if self.next.out(whole, composed_by).all(|part| part != node) {
                    self.add_edge(composed_by, whole, node)?;
                }
                if seen.insert(node) {
                    left.push((node, kind));
                }
            }
        }
        Ok(whole)
    }

    /// The node of a type with these edges, or a new one.
    fn with_edges(&mut self, kind: Symbol, edges: &[(Symbol, NodeId)]) -> Result<NodeId, Error> {
        let next = &self.next;
        if let Some(((relation, end), others)) = edges.split_first() {
            next.node(*end)?;
            let mut there = next.in_(*end, *relation).filter(|node| {
                let is_kind = next.node(*node).is_ok_and(|node| node.kind() == kind);
                let has = |(relation, end): &(Symbol, NodeId)| {
                    next.out(*node, *relation).any(|to| to == *end)
                };
                is_kind && others.iter().all(has)
            });
            if let Some(node) = there.next() {
                return Ok(node);
            }
        }
        let node = self.add_node(kind)?;
        for (relation, end) in edges {
            self.add_edge(*relation, node, *end)?;
        }
        Ok(node)
    }
}
