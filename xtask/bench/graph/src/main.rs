//! Figures of the property graph compared with petgraph and InnerModel, as lines `NAME SECONDS`.
//! `cargo xtask bench graph` runs it, and other peers on the files that it leaves.

mod merging;
mod queries;

use innermodel::{InnerModel, NewNode, Pose};
use petgraph::stable_graph::StableGraph;
use property_graph::schema::{PoseOf, Relation, Tree};
use property_graph::{EdgeId, Error, Graph, NodeId, Point, Schema, Time};
use std::hint::black_box;
use std::path::Path;
use std::time::Instant;

/// The shortest time of one call, in seconds, of several rounds.
fn best(calls: usize, mut round: impl FnMut()) -> f64 {
    let times = (0..15).map(|_| {
        let start = Instant::now();
        round();
        start.elapsed().as_secs_f64() / calls as f64
    });
    times.fold(f64::INFINITY, f64::min)
}

fn print(name: &str, seconds: f64) {
    println!("{name} {seconds:e}");
}

fn schema() -> Schema {
    Schema {
        relations: vec![Relation {
            name: "RT".to_owned(),
            tree: Some(Tree {
                child: 1,
                pose: Some(PoseOf::One("pose".to_owned())),
            }),
            ..Relation::default()
        }],
        ..Schema::anything()
    }
}

/// A graph of nodes with four edges each to random others.
fn random(count: usize) -> (Graph, Vec<NodeId>, StableGraph<u64, u32>) {
    let mut random = fastrand::Rng::with_seed(1);
    let graph = Graph::new(Schema::anything().into(), 1);
    let mut peer = StableGraph::new();
    let nodes = graph.change(Time::ZERO, |edit| {
        let mut nodes = Vec::new();
        for at in 0..count {
            let node = edit.add_node("thing")?;
            edit.set(node, "x", at as f64)?;
            edit.set(node, "y", 1.0)?;
            edit.set(node, "name", format!("n{at}"))?;
            peer.add_node(at as u64);
            nodes.push(node);
        }
        let all: Vec<_> = peer.node_indices().collect();
        for from in 0..count {
            for _ in 0..4 {
                let to = random.usize(0..count);
                edit.add_edge("to", nodes[from], nodes[to])?;
                peer.add_edge(all[from], all[to], 0);
            }
        }
        Ok::<_, Error>(nodes)
    });
    (graph, nodes.expect("a graph"), peer)
}

fn hops(count: usize) {
    let (graph, nodes, peer) = random(count);
    let now = graph.snapshot();
    let to = now.symbol("to").expect("a relation");
    let mut order: Vec<usize> = (0..count).collect();
    fastrand::Rng::with_seed(2).shuffle(&mut order);
    order.truncate(10_000);
    let ids: Vec<NodeId> = order.iter().map(|at| nodes[*at]).collect();
    let all: Vec<_> = peer.node_indices().collect();
    let theirs: Vec<_> = order.iter().map(|at| all[*at]).collect();
    let (mut ours, mut other) = (0_usize, 0_usize);
    let hop = best(ids.len(), || {
        for node in &ids {
            ours += now.out(*node, to).map(|node| black_box(node)).count();
        }
    });
    let plain = best(theirs.len(), || {
        for node in &theirs {
            other += peer.neighbors(*node).map(|node| black_box(node)).count();
        }
    });
    assert_eq!(ours, other);
    print(&format!("hop-{count}"), hop);
    print(&format!("hop-petgraph-{count}"), plain);
}

/// A pose without a rotation.
fn along(x: f64) -> Pose {
    Pose {
        translation: [x, 0.0, 0.0],
        rotation: [0.0; 3],
    }
}

fn changes(count: usize) {
    let (graph, nodes, _) = random(count);
    let attribute = graph.snapshot().symbol("x").expect("an attribute");
    let node = nodes[count / 2];
    let mut value = 0.0;
    let one = best(2000, || {
        for _ in 0..2000 {
            value += 1.0;
            let set = graph.change(Time::ZERO, |edit| edit.set(node, attribute, value));
            set.expect("a change");
        }
    });
    let mut at = 0;
    let far = best(2000, || {
        for _ in 0..2000 {
            value += 1.0;
            at = (at + 64) % count;
            let node = nodes[at];
            let set = graph.change(Time::ZERO, |edit| edit.set(node, attribute, value));
            set.expect("a change");
        }
    });
    let fork = best(1000, || {
        for _ in 0..1000 {
            black_box(graph.fork(1));
        }
    });
    let model = InnerModel::new();
    let ids = model.change(Time::ZERO, |edit| {
        let mut ids = Vec::new();
        for at in 0..count {
            let node = NewNode::transform(at.to_string(), Pose::default());
            ids.push(edit.add("root", node)?);
        }
        Ok::<_, innermodel::Error>(ids)
    });
    let ids = ids.expect("joints");
    let joint = best(2000, || {
        for _ in 0..2000 {
            value += 1.0;
            let set = model.change(Time::ZERO, |edit| {
                edit.set_pose(ids[count / 2], along(value))
            });
            set.expect("a change");
        }
    });
    let joint_far = best(2000, || {
        for _ in 0..2000 {
            value += 1.0;
            at = (at + 64) % count;
            let set = model.change(Time::ZERO, |edit| edit.set_pose(ids[at], along(value)));
            set.expect("a change");
        }
    });
    for (name, time) in [
        ("change", one),
        ("change-far", far),
        ("pose-innermodel", joint),
        ("pose-innermodel-far", joint_far),
        ("fork", fork),
    ] {
        print(&format!("{name}-{count}"), time);
    }
}

fn transforms(length: usize) {
    let graph = Graph::new(schema().into(), 1);
    let made = graph.change(Time::ZERO, |edit| {
        let mut nodes = vec![edit.add_node("frame")?];
        let mut edges: Vec<EdgeId> = Vec::new();
        for at in 0..length {
            let node = edit.add_node("frame")?;
            let edge = edit.add_edge("RT", nodes[at], node)?;
            edit.set(edge, "pose", [0.1, 0.0, 0.0, 0.0, 0.0, 0.1])?;
            nodes.push(node);
            edges.push(edge);
        }
        Ok::<_, Error>((nodes, edges))
    });
    let (nodes, edges) = made.expect("a chain");
    let model = InnerModel::new();
    let pose = Pose {
        translation: [0.1, 0.0, 0.0],
        rotation: [0.0, 0.0, 0.1],
    };
    let ids = model.change(Time::ZERO, |edit| {
        let mut ids = vec![edit.add("root", NewNode::transform("top", Pose::default()))?];
        for at in 0..length {
            ids.push(edit.add(ids[at], NewNode::transform(at.to_string(), pose))?);
        }
        Ok::<_, innermodel::Error>(ids)
    });
    let ids = ids.expect("a chain");
    let (now, peer) = (graph.snapshot(), model.snapshot());
    let ends = [nodes[1], nodes[length]].map(|node| now.frame(node).expect("a frame"));
    let ours = best(10_000, || {
        for _ in 0..10_000 {
            black_box(now.transform(ends[0], Point::origin(), black_box(ends[1])))
                .expect("a point");
        }
    });
    let theirs = best(10_000, || {
        for _ in 0..10_000 {
            black_box(peer.transform(ids[1], Point::origin(), black_box(ids[length])))
                .expect("a point");
        }
    });
    let mut angle = 0.0;
    let moved = best(1000, || {
        for _ in 0..1000 {
            angle += 1e-6;
            let set = graph.change(Time::ZERO, |edit| {
                edit.set(edges[length / 2], "pose", [0.1, 0.0, 0.0, 0.0, 0.0, angle])
            });
            set.expect("a pose");
        }
    });
    let model_moved = best(1000, || {
        for _ in 0..1000 {
            angle += 1e-6;
            let pose = Pose {
                rotation: [0.0, 0.0, angle],
                ..pose
            };
            let set = model.change(Time::ZERO, |edit| edit.set_pose(ids[length / 2], pose));
            set.expect("a pose");
        }
    });
    for (name, time) in [
        ("point", ours),
        ("point-innermodel", theirs),
        ("pose", moved),
        ("pose-innermodel", model_moved),
    ] {
        print(&format!("{name}-over-{length}"), time);
    }
}

/// Loads a file of 1,000 nodes, which it leaves at `path` for others.
fn load(path: &Path) {
    let graph = Graph::new(schema().into(), 0);
    let made = graph.change(Time::ZERO, |edit| {
        let root = edit.add_node("root")?;
        let mut random = fastrand::Rng::with_seed(3);
        for at in 1..1000 {
            let node = edit.add_node("plane")?;
            edit.set(node, "name", format!("node{at}"))?;
            edit.set(node, "color", "SteelBlue")?;
            edit.set(node, "level", 3_i64)?;
            edit.set(node, "pos_x", (random.f64() * 1e6).round() / 1e6)?;
            edit.set(node, "pos_y", (random.f64() * 1e6).round() / 1e6)?;
            edit.set(node, "width", random.i64(0..1000))?;
            let edge = edit.add_edge("in", root, node)?;
            edit.set(edge, "rt_translation", [random.f64().round(), 2.5, 0.0])?;
            edit.set(edge, "rt_rotation_euler_xyz", [0.0, 0.25, 0.0])?;
        }
        Ok::<_, Error>(())
    });
    made.expect("a graph");
    let (text, _) = graph_exchange::dsr::write(&graph_exchange::Document::of(&graph.snapshot()));
    std::fs::write(path, &text).expect("a file");
    let schema = graph_language::builtin("dsr.gdsl").expect("a schema");
    let read = best(1, || {
        let text = std::fs::read_to_string(path).expect("the file");
        let mut sources = rc_diagnostics::SourceMap::new();
        let source = sources.add("a.json", text);
        let document = graph_exchange::dsr::read(&sources, source)
            .0
            .expect("a document");
        black_box(document.kept(&schema, 1).expect("a graph"));
    });
    print("load", read);
}

/// Arguments: a folder for the files, and what is measured, if not all.
fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let folder = Path::new(arguments.first().map_or(".", String::as_str));
    let only = arguments.get(1).map(String::as_str);
    let is_wanted = |name: &str| only.is_none_or(|only| only == name);
    let counts = [100, 1_000, 10_000, 100_000];
    if is_wanted("load") {
        load(&folder.join("dsr.json"));
    }
    if is_wanted("queries") {
        queries::measure(&folder.join("random.json"));
    }
    if is_wanted("merging") {
        merging::measure();
    }
    if is_wanted("hops") {
        counts.into_iter().for_each(hops);
    }
    if is_wanted("changes") {
        counts.into_iter().for_each(changes);
    }
    if is_wanted("transforms") {
        [7, 30].into_iter().for_each(transforms);
    }
}
