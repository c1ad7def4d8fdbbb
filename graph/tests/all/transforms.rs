//! Relations with transforms are a tree of InnerModel.

use crate::changes::kitchen;
use property_graph::schema::{Entity, Port, PoseOf, Relation, Tree};
use property_graph::{Error, Graph, NodeId, Point, Schema, Time};
use std::time::Duration;

fn frames() -> Schema {
    let port = |name: &str| Port {
        name: name.to_owned(),
        entity: "Frame".to_owned(),
        min: 0,
        max: None,
    };
    Schema {
        open: true,
        entities: vec![Entity {
            name: "Frame".to_owned(),
            ..Entity::default()
        }],
        relations: vec![Relation {
            name: "RT".to_owned(),
            ports: vec![port("parent"), port("child")],
            tree: Some(Tree {
                child: 1,
                pose: Some(PoseOf::One("pose".to_owned())),
            }),
            ..Relation::default()
        }],
        ..kitchen()
    }
}

fn chain(graph: &Graph, count: usize) -> Vec<NodeId> {
    let made = graph.change(Time::ZERO, |edit| {
        let mut nodes = vec![edit.add_node("Frame")?];
        for at in 1..count {
            let node = edit.add_node("Frame")?;
            let edge = edit.add_edge("RT", nodes[at - 1], node)?;
            edit.set(edge, "pose", [1.0, 0.0, 0.0, 0.0, 0.0, 0.0])?;
            nodes.push(node);
        }
        Ok::<_, Error>(nodes)
    });
    made.expect("a chain")
}

#[test]
fn transforms_follow_changes_of_the_tree() {
    let graph = Graph::new(frames().into(), 1);
    let nodes = chain(&graph, 4);
    let now = graph.snapshot();
    let frame = |at: usize| now.frame(nodes[at]).expect("a frame");
    let tip = now.transform(frame(0), Point::origin(), frame(3));
    assert_eq!(tip, Ok(Point::new(3.0, 0.0, 0.0)));
    // The last frame moves to the first one.
    let moved = graph.change(Time::ZERO, |edit| {
        let edge = edit.snapshot().in_edges(nodes[3], None).next();
        let edge = edge.map(|edge| edge.edge_id()).expect("an edge");
        edit.remove_edge(edge)?;
        let edge = edit.add_edge("RT", nodes[0], nodes[3])?;
        edit.set(edge, "pose", [0.0, 7.0, 0.0, 0.0, 0.0, 0.0])
    });
    moved.expect("another parent");
    let now = graph.snapshot();
    let tip = now.transform(frame(0), Point::origin(), frame(3));
    assert_eq!(tip, Ok(Point::new(0.0, 7.0, 0.0)));
    // Parent and child change places in one change.
    let swapped = graph.change(Time::ZERO, |edit| {
        for node in [nodes[1], nodes[2]] {
            let edge = edit.snapshot().in_edges(node, None).next();
            let edge = edge.map(|edge| edge.edge_id()).expect("an edge");
            edit.remove_edge(edge)?;
        }
        for (parent, child) in [(nodes[0], nodes[2]), (nodes[2], nodes[1])] {
            let edge = edit.add_edge("RT", parent, child)?;
            edit.set(edge, "pose", [0.0, 0.0, 5.0, 0.0, 0.0, 0.0])?;
        }
        Ok::<(), Error>(())
    });
    swapped.expect("a swap");
    let now = graph.snapshot();
    let tip = now.transform(frame(0), Point::origin(), frame(1));
    assert_eq!(tip, Ok(Point::new(0.0, 0.0, 10.0)));
    // Without its edge, a frame is in a tree of its own.
    let removed = graph.change(Time::ZERO, |edit| edit.remove_node(nodes[2]));
    removed.expect("a removal");
    let now = graph.snapshot();
    assert_eq!(now.between(frame(0), frame(1)), Err(Error::NotConnected));
    assert!(now.between(frame(0), frame(3)).is_ok());
}

#[test]
fn frames_are_removed_in_any_order() {
    for order in [[1, 2, 3], [3, 2, 1], [2, 1, 3]] {
        let graph = Graph::new(frames().into(), 1);
        let nodes = chain(&graph, 5);
        let removed = graph.change(Time::ZERO, |edit| {
            order
                .into_iter()
                .try_for_each(|at| edit.remove_node(nodes[at]))
        });
        removed.expect("a removal");
        let now = graph.snapshot();
        // The root of the model, the first frame, and the last one.
        assert_eq!((now.node_count(), now.tree().len()), (2, 3), "{order:?}");
    }
}

#[test]
fn an_edge_without_a_pose_is_refused() {
    let graph = Graph::new(frames().into(), 1);
    let nodes = chain(&graph, 2);
    let refused = graph.change(Time::ZERO, |edit| {
        let node = edit.add_node("Frame")?;
        edit.add_edge("RT", nodes[1], node).map(|_| ())
    });
    let message = refused.expect_err("no pose").to_string();
    assert_eq!(
        message,
        "an edge of `RT` has no pose: expected six numbers in `pose`"
    );
    assert_eq!(graph.snapshot().node_count(), 2);
}

#[test]
fn the_past_is_interpolated() {
    let graph = Graph::new(frames().into(), 1);
    let nodes = chain(&graph, 2);
    let at = Duration::from_millis;
    for (time, x) in [(100, 10.0), (200, 20.0)] {
        let changed = graph.change(at(time), |edit| {
            let edge = edit.snapshot().in_edges(nodes[1], None).next();
            let edge = edge.map(|edge| edge.edge_id()).expect("an edge");
            edit.set(edge, "pose", [x, 0.0, 0.0, 0.0, 0.0, 0.0])
        });
        changed.expect("another pose");
    }
    let now = graph.snapshot();
    let frames = [nodes[0], nodes[1]].map(|node| now.frame(node).expect("a frame"));
    let then = graph.at(at(150)).expect("a moment");
    let between = then.between(frames[0], frames[1]).expect("a transform");
    assert!((between.translation.x - 15.0).abs() < 1e-12);
}

#[test]
fn a_transform_allocates_nothing() {
    let graph = Graph::new(frames().into(), 1);
    let nodes = chain(&graph, 20);
    let now = graph.snapshot();
    let frames = [nodes[3], nodes[19]].map(|node| now.frame(node).expect("a frame"));
    let allocated = allocation_counter::measure(|| {
        let point = now.transform(frames[0], Point::origin(), frames[1]);
        assert!(point.is_ok());
    });
    assert_eq!(allocated.count_total, 0);
}
