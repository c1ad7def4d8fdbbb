//! Random changes beside a plain map of nodes and edges.

use property_graph::{EdgeId, Edit, Error, Graph, NodeId, Schema, Snapshot, Time, Value};
use std::collections::BTreeMap;

/// The graph as plain lists.
#[derive(Clone, Default)]
struct Plain {
    nodes: BTreeMap<NodeId, BTreeMap<String, i64>>,
    edges: BTreeMap<EdgeId, (String, NodeId, NodeId, BTreeMap<String, i64>)>,
}

fn equal(now: &Snapshot, plain: &Plain) {
    assert_eq!(now.node_count(), plain.nodes.len());
    assert_eq!(now.edge_count(), plain.edges.len());
    for (id, attributes) in &plain.nodes {
        let node = now.node(*id).expect("a node");
        let mut ours: Vec<_> = node
            .attributes()
            .map(|(name, value)| (name.to_owned(), value.as_i64().expect("an integer")))
            .collect();
        ours.sort();
        assert!(ours.iter().map(|(k, v)| (k, v)).eq(attributes));
        assert_eq!(now.find_node(node.id()), Some(*id));
        let mut out: Vec<_> = now
            .out_edges(*id, None)
            .map(|edge| edge.edge_id())
            .collect();
        out.sort();
        let expected = plain.edges.iter().filter(|(_, edge)| edge.1 == *id);
        assert!(out.iter().eq(expected.map(|(edge, _)| edge)));
        let expected = plain.edges.values().filter(|edge| edge.2 == *id);
        assert_eq!(now.predecessors(*id).count(), expected.count());
    }
    for kind in ["a", "b", "c"] {
        let count = now.nodes().filter(|node| node.type_name() == kind).count();
        assert_eq!(now.of_type(kind).count(), count);
        assert_eq!(now.count_of_type(kind), count);
    }
}

fn step(edit: &mut Edit, plain: &mut Plain, random: &mut fastrand::Rng) -> Result<(), Error> {
    let nodes: Vec<NodeId> = plain.nodes.keys().copied().collect();
    let edges: Vec<EdgeId> = plain.edges.keys().copied().collect();
    let kinds = ["a", "b", "c"];
    let kind = kinds[random.usize(0..3)];
    match random.usize(0..10) {
        0..3 => {
            plain.nodes.insert(edit.add_node(kind)?, BTreeMap::new());
        }
        3..6 if !nodes.is_empty() => {
            let (from, to) = (random.usize(0..nodes.len()), random.usize(0..nodes.len()));
            let edge = edit.add_edge(kind, nodes[from], nodes[to])?;
            let made = (kind.to_owned(), nodes[from], nodes[to], BTreeMap::new());
            plain.edges.insert(edge, made);
        }
        6 if !nodes.is_empty() => {
            let node = nodes[random.usize(0..nodes.len())];
            edit.remove_node(node)?;
            plain.nodes.remove(&node);
            plain
                .edges
                .retain(|_, edge| edge.1 != node && edge.2 != node);
            assert_eq!(edit.set(node, "x", 1_i64), Err(Error::Removed));
        }
        7 if !edges.is_empty() => {
            let edge = edges[random.usize(0..edges.len())];
            edit.remove_edge(edge)?;
            plain.edges.remove(&edge);
            assert_eq!(edit.remove_edge(edge), Err(Error::Removed));
        }
        8 if !nodes.is_empty() => {
            let node = nodes[random.usize(0..nodes.len())];
            let value = random.i64(0..100);
            edit.set(node, kind, value)?;
            let attributes = plain.nodes.get_mut(&node).expect("a node");
            attributes.insert(kind.to_owned(), value);
        }
        9 if !edges.is_empty() => {
            let edge = edges[random.usize(0..edges.len())];
            let attributes = &mut plain.edges.get_mut(&edge).expect("an edge").3;
            if random.bool() {
                edit.set(edge, kind, 7_i64)?;
                attributes.insert(kind.to_owned(), 7);
            } else {
                edit.unset(edge, kind)?;
                attributes.remove(kind);
            }
        }
        _ => {}
    }
    Ok(())
}

#[test]
fn random_changes_are_those_of_plain_lists() {
    for seed in 0..20 {
        let mut random = fastrand::Rng::with_seed(seed);
        let graph = Graph::new(Schema::anything().into(), 1);
        let mut plain = Plain::default();
        let mut versions = vec![(graph.snapshot(), plain.clone())];
        for round in 0..60 {
            let mut next = plain.clone();
            let fails = random.u32(0..4) == 0;
            let result = graph.change(Time::ZERO, |edit| {
                for _ in 0..random.usize(1..8) {
                    step(edit, &mut next, &mut random)?;
                }
                // A change that fails leaves nothing.
                if fails { Err(Error::Removed) } else { Ok(()) }
            });
            assert_eq!(result.is_err(), fails);
            if !fails {
                plain = next;
            }
            if round % 10 == 0 {
                versions.push((graph.snapshot(), plain.clone()));
            }
        }
        for (version, plain) in &versions {
            equal(version, plain);
        }
    }
}

#[test]
fn names_of_many_nodes_come_and_go() {
    let graph = Graph::new(Schema::anything().into(), 1);
    let mut random = fastrand::Rng::with_seed(7);
    let mut plain: BTreeMap<NodeId, String> = BTreeMap::new();
    for _ in 0..2000 {
        let name = ["x", "y", "z"][random.usize(0..3)];
        let nodes: Vec<NodeId> = plain.keys().copied().collect();
        let changed = graph.change(Time::ZERO, |edit| {
            if nodes.len() < 5 || random.usize(0..3) == 0 {
                let node = edit.add_node("n")?;
                edit.set(node, "name", name)?;
                plain.insert(node, name.to_owned());
                return Ok::<(), Error>(());
            }
            let node = nodes[random.usize(0..nodes.len())];
            if random.bool() {
                edit.remove_node(node)?;
                plain.remove(&node);
            } else {
                edit.set(node, "name", Value::from(name))?;
                plain.insert(node, name.to_owned());
            }
            Ok(())
        });
        changed.expect("a change");
        let now = graph.snapshot();
        for name in ["x", "y", "z"] {
            let mut ours: Vec<NodeId> = now.named(name).collect();
            ours.sort();
            let named = plain.iter().filter(|(_, known)| *known == name);
            assert!(ours.iter().eq(named.map(|(node, _)| node)));
        }
    }
}
