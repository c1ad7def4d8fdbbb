//! Typed traversals.

use graph_query::{Mark, traverse};
use property_graph::{Error, Graph, NodeId, Schema, Snapshot, Time, Value};
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
    // The first joint has no predecessor.
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

/// A step of a random traversal.
#[derive(Clone, Copy, Debug)]
enum Step {
    Out(&'static str),
    In(&'static str),
    Has(i64),
    HasType(&'static str),
    As(Mark),
    WhereEq(Mark),
    Select(Mark),
    /// Until a node has the value.
    RepeatUntil(&'static str, i64),
}

const KINDS: [&str; 2] = ["a", "b"];

fn random_step(random: &mut fastrand::Rng) -> Step {
    let kind = KINDS[random.usize(0..2)];
    let mark = Mark(random.usize(0..2));
    match random.u32(0..12) {
        0..3 => Step::Out(kind),
        3..6 => Step::In(kind),
        6 => Step::Has(random.i64(0..3)),
        7 => Step::HasType(kind),
        8..10 => Step::As(mark),
        10 if random.bool() => Step::WhereEq(mark),
        10 => Step::Select(mark),
        _ => Step::RepeatUntil(kind, random.i64(0..3)),
    }
}

fn walked(graph: &Snapshot, nodes: &[NodeId], steps: &[Step]) -> Vec<NodeId> {
    let mut way = traverse(graph, nodes.to_vec()).boxed();
    for step in steps {
        way = match *step {
            Step::Out(kind) => way.out(kind).boxed(),
            Step::In(kind) => way.in_(kind).boxed(),
            Step::Has(x) => way.has("x", x).boxed(),
            Step::HasType(kind) => way.has_type(kind).boxed(),
            Step::As(mark) => way.as_(mark).boxed(),
            Step::WhereEq(mark) => way.where_eq(mark).boxed(),
            Step::Select(mark) => way.select(mark).boxed(),
            Step::RepeatUntil(kind, x) => way
                .repeat_until(kind, move |graph, node| {
                    graph.get(node, "x") == Some(&Value::Int(x))
                })
                .boxed(),
        };
    }
    way.fold(Vec::new(), |mut all, _, walker| {
        all.push(walker.node);
        all
    })
}

/// The nodes as numbers: type and value of each, and the edges.
struct Plain {
    nodes: Vec<(&'static str, i64)>,
    edges: Vec<(&'static str, usize, usize)>,
}

impl Plain {
    /// The result by loops over all edges. A way is where it is, and what it has marked.
    fn walked(&self, steps: &[Step]) -> Vec<usize> {
        let mut ways: Vec<(usize, [Option<usize>; 2])> =
            (0..self.nodes.len()).map(|at| (at, [None; 2])).collect();
        for step in steps {
            let mut next = Vec::new();
            for (at, marks) in ways {
                let here = self.nodes[at];
                let ends: Vec<usize> = match *step {
                    Step::Out(kind) => self.ends(kind, |from, to| (from == at).then_some(to)),
                    Step::In(kind) => self.ends(kind, |from, to| (to == at).then_some(from)),
                    Step::Has(x) => (here.1 == x).then_some(at).into_iter().collect(),
                    Step::HasType(kind) => (here.0 == kind).then_some(at).into_iter().collect(),
                    Step::As(_) => vec![at],
                    Step::WhereEq(mark) => marks[mark.0].filter(|m| *m == at).into_iter().collect(),
                    Step::Select(mark) => marks[mark.0].into_iter().collect(),
                    Step::RepeatUntil(kind, x) => self.until(kind, x, at).into_iter().collect(),
                };
                let mut marks = marks;
                if let Step::As(mark) = *step {
                    marks[mark.0] = Some(at);
                }
                next.extend(ends.into_iter().map(|end| (end, marks)));
            }
            ways = next;
        }
        ways.into_iter().map(|(at, _)| at).collect()
    }

    fn ends(&self, kind: &str, end: impl Fn(usize, usize) -> Option<usize>) -> Vec<usize> {
        let edges = self.edges.iter().filter(|edge| edge.0 == kind);
        edges.filter_map(|(_, from, to)| end(*from, *to)).collect()
    }

    /// Along the first edge of each node. Beyond as many steps as there are nodes, it goes in a circle.
    fn until(&self, kind: &str, x: i64, mut at: usize) -> Option<usize> {
        for _ in 0..=self.nodes.len() {
            if self.nodes[at].1 == x {
                return Some(at);
            }
            let next = self.ends(kind, |from, to| (from == at).then_some(to));
            at = *next.first()?;
        }
        None
    }
}

#[test]
fn random_traversals_are_those_of_plain_loops() {
    let mut ends = 0;
    for seed in 0..300 {
        let mut random = fastrand::Rng::with_seed(seed);
        let nodes: Vec<_> = (0..random.usize(2..12))
            .map(|_| (KINDS[random.usize(0..2)], random.i64(0..3)))
            .collect();
        let edges = (0..random.usize(1..30)).map(|_| {
            let [from, to] = [0, 1].map(|_| random.usize(0..nodes.len()));
            (KINDS[random.usize(0..2)], from, to)
        });
        let plain = Plain {
            edges: edges.collect(),
            nodes,
        };
        let graph = Graph::new(Schema::anything().into(), 1);
        let made = graph.change(Time::ZERO, |edit| {
            let mut nodes = Vec::new();
            for (kind, x) in &plain.nodes {
                let node = edit.add_node(*kind)?;
                edit.set(node, "x", *x)?;
                nodes.push(node);
            }
            for (kind, from, to) in &plain.edges {
                edit.add_edge(*kind, nodes[*from], nodes[*to])?;
            }
            Ok::<_, Error>(nodes)
        });
        let nodes = made.expect("a graph");
        let steps: Vec<Step> = (0..random.usize(1..7))
            .map(|_| random_step(&mut random))
            .collect();
        let found = walked(&graph.snapshot(), &nodes, &steps);
        let expected: Vec<NodeId> = plain.walked(&steps).iter().map(|at| nodes[*at]).collect();
        // Edges are found in the order in which they were added.
        assert_eq!(found, expected, "seed {seed}: {steps:?}");
        ends += found.len();
    }
    assert!(ends > 1500, "only {ends} ends");
}
