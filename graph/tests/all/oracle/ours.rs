//! The property graph as a backend.

use super::backend::{Backend, Element, Neighbours, Operations, Refusal};
use property_graph::{EdgeId, Edit, Error, Graph, Id, NodeId, Schema, Time, Value};
use std::sync::Arc;

pub(crate) struct Ours(Graph);

impl Ours {
    pub(crate) fn new() -> Self {
        Self(Graph::new(Schema::anything().into(), 1))
    }
}

fn refusal(error: Error) -> Refusal {
    match error {
        Error::Removed => Refusal::Absent,
        Error::DuplicateId(_) => Refusal::There,
        other => panic!("{other}"),
    }
}

fn element<'a>(
    id: Id,
    kind: &str,
    attributes: impl Iterator<Item = (&'a str, &'a Value)>,
) -> Element {
    let number = |value: &Value| value.as_i64().expect("an integer");
    let attributes = attributes.map(|(name, value)| (name.to_owned(), number(value)));
    Element {
        id: id.count(),
        kind: kind.to_owned(),
        attributes: attributes.collect(),
    }
}

impl Backend for Ours {
    type Node = NodeId;
    type Edge = EdgeId;

    fn change(&mut self, make: impl FnOnce(&mut dyn Operations<NodeId, EdgeId>) -> bool) {
        let before = self.0.snapshot();
        let mut keeps = false;
        let changed = self.0.change(Time::ZERO, |edit| {
            keeps = make(edit);
            if keeps { Ok(()) } else { Err(Error::NoFrame) }
        });
        assert_eq!(changed.is_ok(), keeps);
        assert_eq!(Arc::ptr_eq(&before, &self.0.snapshot()), !keeps);
    }

    fn nodes(&self) -> Vec<Element> {
        let now = self.0.snapshot();
        let nodes = now.nodes();
        nodes
            .map(|node| element(node.id(), node.type_name(), node.attributes()))
            .collect()
    }

    fn edges(&self) -> Vec<(Element, u64, u64)> {
        let now = self.0.snapshot();
        let count = |node: NodeId| now.node(node).expect("a node").id().count();
        let edges = now.edges().map(|edge| {
            let element = element(edge.id(), edge.type_name(), edge.attributes());
            (element, count(edge.from()), count(edge.to()))
        });
        edges.collect()
    }
}

impl Operations<NodeId, EdgeId> for Edit {
    fn add_node(&mut self, id: u64, kind: &str) -> Result<NodeId, Refusal> {
        self.add_node_as(Id::new(0, id), kind).map_err(refusal)
    }

    fn remove_node(&mut self, node: NodeId) -> Result<(), Refusal> {
        Edit::remove_node(self, node).map_err(refusal)
    }

    fn add_edge(
        &mut self,
        id: u64,
        kind: &str,
        from: NodeId,
        to: NodeId,
    ) -> Result<EdgeId, Refusal> {
        let made = self.add_edge_as(Id::new(0, id), kind, from, to);
        made.map_err(refusal)
    }

    fn remove_edge(&mut self, edge: EdgeId) -> Result<(), Refusal> {
        Edit::remove_edge(self, edge).map_err(refusal)
    }

    fn set_node(&mut self, node: NodeId, name: &str, value: Option<i64>) -> Result<(), Refusal> {
        let set = match value {
            Some(value) => self.set(node, name, value),
            None => self.unset(node, name),
        };
        set.map_err(refusal)
    }

    fn set_edge(&mut self, edge: EdgeId, name: &str, value: Option<i64>) -> Result<(), Refusal> {
        let set = match value {
            Some(value) => self.set(edge, name, value),
            None => self.unset(edge, name),
        };
        set.map_err(refusal)
    }

    fn neighbours(&self, node: NodeId) -> Result<Neighbours, Refusal> {
        let graph = self.snapshot();
        if graph.node(node).is_err() {
            let others = graph.successors(node).chain(graph.predecessors(node));
            assert_eq!(others.count(), 0);
            return Err(Refusal::Absent);
        }
        let count = |node: NodeId| graph.node(node).expect("a node").id().count();
        let out = graph.out_edges(node, None);
        let in_ = graph.in_edges(node, None);
        Ok(Neighbours {
            out: out.map(|e| (e.id().count(), count(e.to()))).collect(),
            in_: in_.map(|e| (e.id().count(), count(e.from()))).collect(),
            successors: graph.successors(node).map(count).collect(),
            predecessors: graph.predecessors(node).map(count).collect(),
        })
    }
}
