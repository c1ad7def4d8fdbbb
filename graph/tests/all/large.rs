//! A large change takes time in proportion to its steps, whatever the form of the graph.

use property_graph::schema::{Attribute, Entity, Kind, Port, PoseOf, Relation, Tree};
use property_graph::{Edit, Error, Graph, NodeId, Schema, Time, Value};
use std::time::{Duration, Instant};

/// Places with a bounded relation, and with a tree of frames.
fn places() -> Schema {
    let port = |name: &str| Port {
        name: name.to_owned(),
        entity: "Place".to_owned(),
        min: 0,
        max: Some(1_000_000),
    };
    let pose = Attribute {
        name: "pose".to_owned(),
        kind: Kind::Floats(Some(6)),
        unit: None,
        range: None,
        optional: false,
        key: false,
        history: None,
        doc: Vec::new(),
    };
    Schema {
        name: "places".to_owned(),
        open: true,
        entities: vec![Entity {
            name: "Place".to_owned(),
            ..Entity::default()
        }],
        relations: vec![
            Relation {
                name: "near".to_owned(),
                ports: vec![port("one"), port("other")],
                ..Relation::default()
            },
            Relation {
                name: "below".to_owned(),
                ports: vec![port("child"), port("parent")],
                attributes: vec![pose],
                tree: Some(Tree {
                    child: 0,
                    pose: Some(PoseOf::One("pose".to_owned())),
                }),
                ..Relation::default()
            },
        ],
        ..Schema::default()
    }
}

fn nodes(edit: &mut Edit, count: usize) -> Result<Vec<NodeId>, Error> {
    (0..count).map(|_| edit.add_node("Place")).collect()
}

/// A node with edges to all others. It is removed afterwards.
fn hub(graph: &Graph, count: usize) -> Result<(), Error> {
    let hub = graph.change(Time::ZERO, |edit| {
        let all = nodes(edit, count)?;
        for other in &all[1..] {
            edit.add_edge("near", all[0], *other)?;
        }
        Ok::<_, Error>(all[0])
    })?;
    let now = graph.snapshot();
    assert_eq!(now.successors(hub).count(), count - 1);
    graph.change(Time::ZERO, |edit| edit.remove_node(hub))?;
    assert_eq!(graph.snapshot().edge_count(), 0);
    Ok(())
}

fn place_below(edit: &mut Edit, child: NodeId, parent: NodeId) -> Result<(), Error> {
    let edge = edit.add_edge("below", child, parent)?;
    let pose = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    edit.set(edge, "pose", Value::Floats(pose.into()))
}

/// A chain of frames: each is below the one before it.
fn chain(graph: &Graph, count: usize) -> Result<(), Error> {
    let (top, last) = graph.change(Time::ZERO, |edit| {
        let all = nodes(edit, count)?;
        for pair in all.windows(2) {
            place_below(edit, pair[1], pair[0])?;
        }
        Ok::<_, Error>((all[0], all[count - 1]))
    })?;
    let now = graph.snapshot();
    let pose = now.pose(top, last)?;
    assert!((pose.translation[0] - (count - 1) as f64).abs() < 1e-6);
    // The tree is checked as one of few edges is: its top cannot be below its last frame.
    let circle = graph.change(Time::ZERO, |edit| {
        let more = nodes(edit, 100)?;
        for node in more {
            edit.add_edge("near", node, top)?;
        }
        place_below(edit, top, last)
    });
    assert!(matches!(circle, Err(Error::Cycle(..))), "{circle:?}");
    Ok(())
}

/// A node with many attributes.
fn attributes(graph: &Graph, count: usize) -> Result<(), Error> {
    let node = graph.change(Time::ZERO, |edit| {
        let node = edit.add_node("Place")?;
        edit.set(node, "a7", 1)?;
        let names: Vec<String> = (0..count).map(|at| format!("a{at}")).collect();
        let values = names.iter().enumerate().map(|(at, n)| (&**n, at as i64));
        // A name that is there twice has its last value.
        edit.set_all(node, values.chain([("a3", 42)]))?;
        Ok::<_, Error>(node)
    })?;
    let now = graph.snapshot();
    assert_eq!(now.node(node)?.attributes().count(), count);
    assert_eq!(now.get(node, "a3"), Some(&Value::Int(42)));
    assert_eq!(now.get(node, "a7"), Some(&Value::Int(7)));
    Ok(())
}

#[test]
fn hubs_deep_trees_and_many_attributes_take_time_in_proportion() {
    type Form = fn(&Graph, usize) -> Result<(), Error>;
    let forms: [(&str, Form); 3] = [("hub", hub), ("chain", chain), ("attributes", attributes)];
    for (name, form) in forms {
        let time = |count| {
            let graph = Graph::new(places().into(), 1);
            let started = Instant::now();
            form(&graph, count).expect("a graph");
            started.elapsed()
        };
        let (short, long) = (time(1_500), time(24_000));
        assert!(
            long < short * 60 + Duration::from_millis(200),
            "{name}: 1,500 in {short:?}, 24,000 in {long:?}"
        );
    }
}

#[test]
fn a_cycle_above_the_node_that_is_checked_first_is_found() {
    let graph = Graph::new(places().into(), 1);
    let changed = graph.change(Time::ZERO, |edit| {
        let all = nodes(edit, 100)?;
        place_below(edit, all[0], all[1])?;
        place_below(edit, all[1], all[2])?;
        place_below(edit, all[2], all[1])
    });
    assert!(matches!(changed, Err(Error::Cycle(..))), "{changed:?}");
}

/// A change that makes many nodes is made whole, or not at all: as many as `RC_GRAPH_NODES` says.
#[test]
fn a_change_of_many_nodes_leaves_nothing_if_it_fails() {
    let count = std::env::var("RC_GRAPH_NODES").ok();
    let count = count.map_or(50_000, |count| count.parse().expect("a number of nodes"));
    let graph = Graph::new(places().into(), 1);
    let before = graph.snapshot();
    let made = |last: &dyn Fn(&mut Edit) -> Result<(), Error>| {
        graph.change(Time::ZERO, |edit| {
            for _ in 0..count {
                edit.add_node("Place")?;
            }
            last(edit)
        })
    };
    let refused = made(&|edit| edit.add_node("Plaice").and(Err(Error::NoFrame)));
    assert_eq!(refused, Err(Error::NoFrame));
    assert_eq!(graph.snapshot().version(), before.version());
    assert_eq!(graph.snapshot().node_count(), 0);
    assert_eq!(made(&|_| Ok(())), Ok(()));
    assert_eq!(graph.snapshot().count_of_type("Place"), count);
}
