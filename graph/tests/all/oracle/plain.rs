//! petgraph as a backend: a graph without versions, a schema or indices. A change copies all of it.

use super::backend::{Backend, Element, Neighbours, Operations, Refusal};
use petgraph::Direction::{Incoming, Outgoing};
use petgraph::stable_graph::{EdgeIndex, NodeIndex, StableGraph};
use petgraph::visit::{EdgeRef as _, IntoEdgeReferences as _};
use std::collections::{BTreeMap, HashSet};

/// A node or an edge. petgraph gives a place again after its element was removed, so each element has a
/// number of its own.
#[derive(Clone)]
struct Weight {
    number: u64,
    id: u64,
    kind: String,
    attributes: BTreeMap<String, i64>,
}

impl Weight {
    fn element(&self) -> Element {
        let attributes = self.attributes.iter();
        Element {
            id: self.id,
            kind: self.kind.clone(),
            attributes: attributes
                .map(|(name, value)| (name.clone(), *value))
                .collect(),
        }
    }

    fn set(&mut self, name: &str, value: Option<i64>) {
        match value {
            Some(value) => self.attributes.insert(name.to_owned(), value),
            None => self.attributes.remove(name),
        };
    }
}

#[derive(Clone, Default)]
pub(crate) struct Plain {
    graph: StableGraph<Weight, Weight>,
    ids: HashSet<u64>,
    made: u64,
}

pub(crate) type Node = (NodeIndex, u64);
pub(crate) type Edge = (EdgeIndex, u64);

impl Plain {
    fn weight(&mut self, id: u64, kind: &str) -> Result<Weight, Refusal> {
        if !self.ids.insert(id) {
            return Err(Refusal::There);
        }
        self.made += 1;
        Ok(Weight {
            number: self.made,
            id,
            kind: kind.to_owned(),
            attributes: BTreeMap::new(),
        })
    }

    fn node(&self, (at, number): Node) -> Result<NodeIndex, Refusal> {
        let weight = self.graph.node_weight(at).filter(|w| w.number == number);
        weight.map(|_| at).ok_or(Refusal::Absent)
    }

    fn edge(&self, (at, number): Edge) -> Result<EdgeIndex, Refusal> {
        let weight = self.graph.edge_weight(at).filter(|w| w.number == number);
        weight.map(|_| at).ok_or(Refusal::Absent)
    }
}

impl Backend for Plain {
    type Node = Node;
    type Edge = Edge;

    fn change(&mut self, make: impl FnOnce(&mut dyn Operations<Node, Edge>) -> bool) {
        let mut next = self.clone();
        if make(&mut next) {
            *self = next;
        }
    }

    fn nodes(&self) -> Vec<Element> {
        self.graph.node_weights().map(Weight::element).collect()
    }

    fn edges(&self) -> Vec<(Element, u64, u64)> {
        let id = |node: NodeIndex| self.graph[node].id;
        let edges = self.graph.edge_references().map(|edge| {
            let element = edge.weight().element();
            (element, id(edge.source()), id(edge.target()))
        });
        edges.collect()
    }
}

impl Operations<Node, Edge> for Plain {
    fn add_node(&mut self, id: u64, kind: &str) -> Result<Node, Refusal> {
        let weight = self.weight(id, kind)?;
        let number = weight.number;
        Ok((self.graph.add_node(weight), number))
    }

    fn remove_node(&mut self, node: Node) -> Result<(), Refusal> {
        let at = self.node(node)?;
        for direction in [Outgoing, Incoming] {
            let edges = self.graph.edges_directed(at, direction);
            let ids: Vec<u64> = edges.map(|edge| edge.weight().id).collect();
            self.ids.retain(|id| !ids.contains(id));
        }
        let weight = self.graph.remove_node(at).ok_or(Refusal::Absent)?;
        self.ids.remove(&weight.id);
        Ok(())
    }

    fn add_edge(&mut self, id: u64, kind: &str, from: Node, to: Node) -> Result<Edge, Refusal> {
        let (from, to) = (self.node(from)?, self.node(to)?);
        let weight = self.weight(id, kind)?;
        let number = weight.number;
        Ok((self.graph.add_edge(from, to, weight), number))
    }

    fn remove_edge(&mut self, edge: Edge) -> Result<(), Refusal> {
        let at = self.edge(edge)?;
        let weight = self.graph.remove_edge(at).ok_or(Refusal::Absent)?;
        self.ids.remove(&weight.id);
        Ok(())
    }

    fn set_node(&mut self, node: Node, name: &str, value: Option<i64>) -> Result<(), Refusal> {
        let at = self.node(node)?;
        self.graph[at].set(name, value);
        Ok(())
    }

    fn set_edge(&mut self, edge: Edge, name: &str, value: Option<i64>) -> Result<(), Refusal> {
        let at = self.edge(edge)?;
        self.graph[at].set(name, value);
        Ok(())
    }

    fn neighbours(&self, node: Node) -> Result<Neighbours, Refusal> {
        let at = self.node(node)?;
        let id = |node: NodeIndex| self.graph[node].id;
        let out = self.graph.edges_directed(at, Outgoing);
        let in_ = self.graph.edges_directed(at, Incoming);
        let next = |direction| {
            self.graph
                .neighbors_directed(at, direction)
                .map(id)
                .collect()
        };
        Ok(Neighbours {
            out: out.map(|e| (e.weight().id, id(e.target()))).collect(),
            in_: in_.map(|e| (e.weight().id, id(e.source()))).collect(),
            successors: next(Outgoing),
            predecessors: next(Incoming),
        })
    }
}
