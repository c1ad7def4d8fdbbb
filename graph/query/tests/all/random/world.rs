//! Small random graphs, as plain lists and as our graph.

use property_graph::{Error, Graph, Schema, Snapshot, Time};
use std::sync::Arc;

pub(crate) const KINDS: [&str; 2] = ["A", "B"];
pub(crate) const RELATIONS: [&str; 2] = ["r", "s"];
pub(crate) const NAMES: [&str; 4] = ["a", "b", "ab", "c"];

pub(crate) struct Node {
    pub(crate) kind: &'static str,
    /// Another number for each node.
    pub(crate) k: i64,
    pub(crate) x: Option<i64>,
    pub(crate) name: Option<&'static str>,
}

pub(crate) struct Edge {
    pub(crate) kind: &'static str,
    pub(crate) from: usize,
    pub(crate) to: usize,
    pub(crate) w: Option<i64>,
}

pub(crate) struct World {
    pub(crate) nodes: Vec<Node>,
    pub(crate) edges: Vec<Edge>,
}

impl World {
    pub(crate) fn random(random: &mut fastrand::Rng) -> Self {
        let nodes: Vec<Node> = (0..random.usize(3..7))
            .map(|k| Node {
                kind: KINDS[random.usize(0..2)],
                k: k as i64,
                x: (random.u32(0..5) > 0).then(|| random.i64(0..4)),
                name: (random.u32(0..5) > 0).then(|| NAMES[random.usize(0..4)]),
            })
            .collect();
        let edges = (0..random.usize(5..13)).map(|_| Edge {
            kind: RELATIONS[random.usize(0..2)],
            from: random.usize(0..nodes.len()),
            to: random.usize(0..nodes.len()),
            w: (random.u32(0..6) > 0).then(|| random.i64(0..3)),
        });
        Self {
            edges: edges.collect(),
            nodes,
        }
    }

    pub(crate) fn graph(&self) -> Arc<Snapshot> {
        let graph = Graph::new(Schema::anything().into(), 1);
        let made = graph.change(Time::ZERO, |edit| {
            let mut nodes = Vec::new();
            for node in &self.nodes {
                let made = edit.add_node(node.kind)?;
                edit.set(made, "k", node.k)?;
                if let Some(x) = node.x {
                    edit.set(made, "x", x)?;
                }
                if let Some(name) = node.name {
                    edit.set(made, "name", name)?;
                }
                nodes.push(made);
            }
            for edge in &self.edges {
                let made = edit.add_edge(edge.kind, nodes[edge.from], nodes[edge.to])?;
                if let Some(w) = edge.w {
                    edit.set(made, "w", w)?;
                }
            }
            Ok::<(), Error>(())
        });
        made.expect("a graph");
        graph.snapshot()
    }

    /// The lists as JSON.
    pub(crate) fn json(&self) -> serde_json::Value {
        let nodes = self.nodes.iter();
        let nodes = nodes.map(|n| serde_json::json!([n.kind, n.k, n.x, n.name]));
        let edges = self.edges.iter();
        let edges = edges.map(|e| serde_json::json!([e.kind, e.from, e.to, e.w]));
        serde_json::json!({
            "nodes": nodes.collect::<Vec<_>>(),
            "edges": edges.collect::<Vec<_>>(),
        })
    }
}
