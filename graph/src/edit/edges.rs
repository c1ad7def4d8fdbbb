//! Edges, and the lists that their nodes keep of them.

use super::{Edit, MOST_ELEMENTS, unknown_type};
use crate::element::{Edge, EdgeId, Half, Id, NONE, NodeId};
use crate::error::Error;
use crate::names::{Named, Symbol};
use std::collections::HashSet;

impl Edit {
    /// Adds an edge.
    pub fn add_edge(
        &mut self,
        relation: impl Named,
        from: NodeId,
        to: NodeId,
    ) -> Result<EdgeId, Error> {
        let id = self.fresh();
        self.link(id, relation, from, to)
    }

    /// Adds an edge that another graph made, or a file.
    pub fn add_edge_as(
        &mut self,
        id: Id,
        relation: impl Named,
        from: NodeId,
        to: NodeId,
    ) -> Result<EdgeId, Error> {
        self.next.place(from)?;
        self.next.place(to)?;
        self.claim(id)?;
        self.link(id, relation, from, to)
    }

    /// Adds an edge whose id no element has.
    fn link(
        &mut self,
        id: Id,
        relation: impl Named,
        from: NodeId,
        to: NodeId,
    ) -> Result<EdgeId, Error> {
        self.step()?;
        self.next.place(from)?;
        self.next.place(to)?;
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

    /// Notes that a node may have moved in the tree of frames.
    pub(super) fn note_moved(&mut self, relation: Symbol, from: NodeId, to: NodeId) {
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
}
