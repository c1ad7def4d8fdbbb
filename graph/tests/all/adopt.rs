//! A graph takes over what another one holds, in one change.

use property_graph::schema::{Attribute, Entity, Kind, Port, Relation};
use property_graph::{Change, Error, Graph, Id, NodeId, Schema, Snapshot, Time, Value};
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

/// All that a version holds: elements by id, with type, ends and attributes.
fn content(of: &Snapshot) -> BTreeMap<Id, (String, Vec<Id>, BTreeMap<String, String>)> {
    let listed = |all: &mut dyn Iterator<Item = (&str, &Value)>| {
        let all = all.map(|(name, value)| (name.to_owned(), format!("{value:?}")));
        all.collect::<BTreeMap<_, _>>()
    };
    let end = |node: NodeId| of.node(node).expect("an end").id();
    let nodes = of.nodes().map(|node| {
        let attributes = listed(&mut node.attributes());
        (
            node.id(),
            (node.type_name().to_owned(), Vec::new(), attributes),
        )
    });
    let edges = of.edges().map(|edge| {
        let ends = vec![end(edge.from()), end(edge.to())];
        let attributes = listed(&mut edge.attributes());
        (edge.id(), (edge.type_name().to_owned(), ends, attributes))
    });
    nodes.chain(edges).collect()
}

/// A change at random: nodes, edges, also at edges, and attributes.
fn step(graph: &Graph, random: &mut fastrand::Rng) {
    let now = graph.snapshot();
    let nodes: Vec<NodeId> = now.nodes().map(|node| node.node_id()).collect();
    let edges: Vec<_> = now.edges().map(|edge| edge.edge_id()).collect();
    let kind = ["person", "room"][random.usize(0..2)];
    let made = graph.change(now.time(), |edit| {
        match random.u32(0..8) {
            0..2 => {
                let node = edit.add_node(kind)?;
                edit.set(node, "name", kind)?;
            }
            2..4 if nodes.len() > 1 => {
                let (a, b) = (random.choice(&nodes), random.choice(&nodes));
                edit.add_edge("in", *a.expect("a node"), *b.expect("a node"))?;
            }
            4 if !edges.is_empty() && !nodes.is_empty() => {
                let edge = edit.node_of(*random.choice(&edges).expect("an edge"))?;
                edit.add_edge("says", *random.choice(&nodes).expect("a node"), edge)?;
            }
            5 if !edges.is_empty() => edit.remove_edge(edges[random.usize(0..edges.len())])?,
            6 if nodes.len() > 5 => edit.remove_node(nodes[random.usize(0..nodes.len())])?,
            _ if !nodes.is_empty() => {
                let node = nodes[random.usize(0..nodes.len())];
                if random.bool() {
                    edit.set(node, "age", random.i64(0..3))?;
                } else {
                    edit.unset(node, "age")?;
                }
            }
            _ => {}
        }
        Ok::<_, Error>(())
    });
    made.expect("a change");
}

#[test]
fn it_becomes_the_other_one_whatever_it_held() {
    for seed in 0..40 {
        let mut random = fastrand::Rng::with_seed(seed);
        let other = Graph::new(Schema::anything().into(), 1);
        let graph = Graph::new(Schema::anything().into(), 2);
        // Elements of its own, which the other one does not have.
        for _ in 0..random.usize(0..20) {
            step(&graph, &mut random);
        }
        for round in 0..6_u64 {
            for _ in 0..random.usize(1..30) {
                step(&other, &mut random);
            }
            let wanted = other.snapshot();
            graph
                .adopt(Duration::from_millis(round), &wanted)
                .expect("a change");
            assert_eq!(content(&graph.snapshot()), content(&wanted), "seed {seed}");
            // Once more, nothing is left to do.
            let before = graph.snapshot();
            graph
                .adopt(Duration::from_secs(9), &wanted)
                .expect("no change");
            assert!(Arc::ptr_eq(&before, &graph.snapshot()), "seed {seed}");
        }
    }
}

#[test]
fn what_is_equal_stays_as_it_is() {
    let other = Graph::new(Schema::anything().into(), 1);
    let (ada, kitchen) = other
        .change(Time::ZERO, |edit| {
            let (ada, kitchen) = (edit.add_node("person")?, edit.add_node("room")?);
            edit.add_edge("in", ada, kitchen)?;
            edit.set(ada, "age", 36_i64)?;
            Ok::<_, Error>((ada, kitchen))
        })
        .expect("a graph");
    let graph = Graph::new(Schema::anything().into(), 2);
    // Other names come first here, so that symbols differ.
    graph
        .change(Time::ZERO, |edit| edit.add_node("room").map(|_| ()))
        .expect("a change");
    graph
        .adopt(Time::ZERO, &other.snapshot())
        .expect("a change");
    let before = graph.snapshot();
    let id = |node| other.snapshot().node(node).expect("a node").id();
    let own = before.find_node(id(ada)).expect("Ada");
    other
        .change(Time::ZERO, |edit| {
            edit.set(ada, "age", 37_i64)?;
            edit.set(kitchen, "name", "kitchen")
        })
        .expect("a change");
    graph
        .adopt(Time::ZERO, &other.snapshot())
        .expect("a change");
    let now = graph.snapshot();
    assert_eq!(now.find_node(id(ada)), Some(own));
    let kitchen = now.find_node(id(kitchen)).expect("a kitchen");
    let mut changes = now.since(&before);
    changes.sort_by_key(|change| format!("{change:?}"));
    let attribute = |node: NodeId, name: &str| {
        Change::Attribute(node.into(), now.symbol(name).expect("a name"))
    };
    let mut expected = vec![attribute(own, "age"), attribute(kitchen, "name")];
    expected.sort_by_key(|change| format!("{change:?}"));
    assert_eq!(changes, expected);
}

#[test]
fn what_the_schema_does_not_allow_changes_nothing() {
    let age = Attribute {
        name: "age".to_owned(),
        kind: Kind::Int,
        unit: None,
        range: Some((0.0, 150.0)),
        optional: false,
        key: false,
        history: None,
        doc: Vec::new(),
    };
    let schema = Schema {
        entities: vec![Entity {
            name: "person".to_owned(),
            attributes: vec![age],
            ..Entity::default()
        }],
        relations: vec![Relation {
            name: "knows".to_owned(),
            ports: vec![Port::default(), Port::default()],
            ..Relation::default()
        }],
        ..Schema::default()
    };
    let graph = Graph::new(schema.into(), 2);
    let other = Graph::new(Schema::anything().into(), 1);
    let set = |age: i64| {
        let now = other.snapshot();
        let person = now.nodes().next().map(|node| node.node_id());
        let made = other.change(Time::ZERO, |edit| {
            let person = match person {
                Some(person) => person,
                None => edit.add_node("person")?,
            };
            edit.set(person, "age", age)
        });
        made.expect("a change");
        graph.adopt(Time::ZERO, &other.snapshot())
    };
    set(36).expect("a person");
    let before = graph.snapshot();
    let refused = set(200).expect_err("too old");
    assert_eq!(
        refused.to_string(),
        "`age` of `person` is in 0:150, found 200"
    );
    assert!(Arc::ptr_eq(&before, &graph.snapshot()));
}

/// A node in one graph is an edge in the other one, with the same id.
#[test]
fn elements_with_equal_ids_become_what_they_are_there() {
    let id = |count| Id::new(1, count);
    let make = |nodes: [u64; 2], edge: u64| {
        let graph = Graph::new(Schema::anything().into(), 1);
        let made = graph.change(Time::ZERO, |edit| {
            let a = edit.add_node_as(id(nodes[0]), "person")?;
            let b = edit.add_node_as(id(nodes[1]), "room")?;
            let edge = edit.add_edge_as(id(edge), "in", a, b)?;
            edit.set(edge, "since", 3_i64)
        });
        made.expect("a change");
        graph
    };
    for (ours, theirs) in [
        (([1, 2], 3), ([3, 2], 1)),
        (([1, 2], 3), ([2, 1], 3)),
        (([1, 2], 3), ([2, 3], 1)),
    ] {
        let (own, other) = (make(ours.0, ours.1), make(theirs.0, theirs.1));
        own.adopt(Time::ZERO, &other.snapshot()).expect("a change");
        assert_eq!(content(&own.snapshot()), content(&other.snapshot()));
        let before = own.snapshot();
        own.adopt(Time::ZERO, &other.snapshot()).expect("no change");
        assert!(Arc::ptr_eq(&before, &own.snapshot()));
    }
}
