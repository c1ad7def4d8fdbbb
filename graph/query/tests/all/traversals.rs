//! Typed traversals.

use graph_query::{Mark, traverse};
use property_graph::{Error, Graph, NodeId, Schema, Snapshot, Time, Value};
use std::collections::BTreeSet;
use std::sync::Arc;

/// D's Figure 3.11: a joint has a frame of its own, and a predecessor. The wanted pose has a target
/// and a reference.
const JOINT: Mark = Mark(0);
const POSE: Mark = Mark(1);

fn joints(count: usize) -> (Arc<Snapshot>, Vec<NodeId>, Vec<NodeId>) {
    let graph = Graph::new(Schema::anything().into(), 1);
    let made = graph.change(Time::ZERO, |edit| {
        let (mut joints, mut poses, mut frames) = (Vec::new(), Vec::new(), Vec::new());
        for at in 0..count {
            let joint = edit.add_node("Joint")?;
            let frame = edit.add_node("Frame")?;
            edit.add_edge("my_frame", joint, frame)?;
            joints.push(joint);
            frames.push(frame);
            if at > 0 {
                edit.add_edge("predecessor", joint, joints[at - 1])?;
            }
        }
        // A pose of each frame in each of the two before it: one of them is wanted.
        for at in 1..count {
            for back in 1..=2.min(at) {
                let pose = edit.add_node("Pose")?;
                edit.set(pose, "length", back as f64)?;
                edit.add_edge("target", pose, frames[at])?;
                edit.add_edge("reference", pose, frames[at - back])?;
                if back == 1 {
                    poses.push(pose);
                }
            }
        }
        Ok::<_, Error>((joints, poses))
    });
    let (joints, poses) = made.expect("a robot");
    (graph.snapshot(), joints, poses)
}

/// `joint.pose_wrt_predecessor()`.
fn pose_wrt_predecessor(graph: &Snapshot, joint: NodeId) -> impl Iterator<Item = NodeId> {
    traverse(graph, [joint])
        .as_(JOINT)
        .out("my_frame")
        .in_("target")
        .as_(POSE)
        .out("reference")
        .in_("my_frame")
        .in_("predecessor")
        .where_eq(JOINT)
        .select(POSE)
        .nodes()
}

#[test]
fn the_pose_of_a_joint_in_its_predecessor_is_found() {
    // A UR5 has six joints, a Franka seven, a humanoid thirty.
    for count in [6, 7, 30] {
        let (graph, joints, poses) = joints(count);
        for (joint, pose) in joints[1..].iter().zip(&poses) {
            let found: Vec<NodeId> = pose_wrt_predecessor(&graph, *joint).collect();
            assert_eq!(found, [*pose]);
        }
        assert_eq!(pose_wrt_predecessor(&graph, joints[0]).count(), 0);
    }
}

#[test]
fn a_traversal_allocates_nothing() {
    let (graph, joints, poses) = joints(30);
    let allocated = allocation_counter::measure(|| {
        let found = pose_wrt_predecessor(&graph, joints[20]).next();
        assert_eq!(found, Some(poses[19]));
    });
    assert_eq!(allocated.count_total, 0);
}

#[test]
fn a_path_is_repeated_and_folded() {
    let (graph, joints, _) = joints(10);
    let first = joints[0];
    let start = traverse(&graph, [joints[9]]);
    let found = start.repeat_until("predecessor", |_, node| node == first);
    assert_eq!(found.nodes().collect::<Vec<_>>(), [first]);
    // Nobody is before the first joint.
    let start = traverse(&graph, [joints[9]]);
    assert_eq!(start.repeat_until("predecessor", |_, _| false).count(), 0);
    let poses = traverse(&graph, graph.of_type("Pose")).has("length", 2.0);
    let sum = poses.fold(0.0, |sum, graph, walker| {
        let length = graph.get(walker.node, "length").and_then(Value::as_f64);
        sum + length.unwrap_or_default()
    });
    assert_eq!(sum, 16.0);
    assert_eq!(traverse(&graph, joints).has_type("Frame").count(), 0);
}

#[test]
fn random_traversals_are_those_of_plain_loops() {
    for seed in 0..300 {
        let mut random = fastrand::Rng::with_seed(seed);
        let graph = Graph::new(Schema::anything().into(), 1);
        let kinds = ["a", "b"];
        let made = graph.change(Time::ZERO, |edit| {
            let mut nodes = Vec::new();
            for _ in 0..random.usize(2..12) {
                let node = edit.add_node(kinds[random.usize(0..2)])?;
                edit.set(node, "x", random.i64(0..3))?;
                nodes.push(node);
            }
            for _ in 0..random.usize(1..30) {
                let ends = [0, 1].map(|_| nodes[random.usize(0..nodes.len())]);
                edit.add_edge(kinds[random.usize(0..2)], ends[0], ends[1])?;
            }
            Ok::<_, Error>(nodes)
        });
        let nodes = made.expect("a graph");
        let now = graph.snapshot();
        let edges: Vec<(String, NodeId, NodeId)> = now
            .edges()
            .map(|edge| (edge.type_name().to_owned(), edge.from(), edge.to()))
            .collect();
        let [first, second] = [0, 1].map(|_| kinds[random.usize(0..2)]);
        let wanted = random.i64(0..3);
        // Nodes from which one comes back to the start by an edge out and an edge in, over a node
        // with a value.
        let found = traverse(&now, nodes.iter().copied())
            .as_(Mark(0))
            .out(first)
            .has("x", wanted)
            .in_(second)
            .where_eq(Mark(0));
        let mut found: Vec<NodeId> = found.nodes().collect();
        found.sort();
        let mut expected = Vec::new();
        for start in &nodes {
            for (kind, from, to) in &edges {
                let value = now.get(*to, "x").and_then(Value::as_i64);
                if kind != first || from != start || value != Some(wanted) {
                    continue;
                }
                let back = edges
                    .iter()
                    .filter(|e| e.0 == second && e.2 == *to && e.1 == *start);
                expected.extend(back.map(|_| *start));
            }
        }
        expected.sort();
        assert_eq!(found, expected, "seed {seed}");
        let unique: BTreeSet<NodeId> = found.into_iter().collect();
        assert!(unique.len() <= nodes.len());
    }
}
