//! Loops of poses: chains, and how far they disagree.

use property_graph::schema::{Entity, Placed, Port, PoseOf, Relation, Tree};
use property_graph::{
    Disagreement, Edit, Error, Graph, NodeId, Pose, Schema, Snapshot, Time, Transform,
};
use std::sync::Arc;

fn schema() -> Schema {
    let port = |name: &str| Port {
        name: name.to_owned(),
        entity: "Frame".to_owned(),
        ..Port::default()
    };
    let pose = PoseOf::One("pose".to_owned());
    let relation = |name: &str, ports: [&str; 2]| Relation {
        name: name.to_owned(),
        ports: ports.map(port).into(),
        ..Relation::default()
    };
    Schema {
        open: true,
        entities: vec![Entity {
            name: "Frame".to_owned(),
            ..Entity::default()
        }],
        relations: vec![
            Relation {
                tree: Some(Tree {
                    child: 1,
                    pose: Some(pose.clone()),
                }),
                ..relation("RT", ["parent", "child"])
            },
            Relation {
                pose: Some(Placed { child: 0, pose }),
                ..relation("seen_from", ["child", "parent"])
            },
        ],
        ..Schema::default()
    }
}

type Numbers = [f64; 6];

fn link(edit: &mut Edit, kind: &str, ends: [NodeId; 2], pose: Numbers) -> Result<(), Error> {
    let edge = edit.add_edge(kind, ends[0], ends[1])?;
    edit.set(edge, "pose", pose)
}

/// a → b → c → d in a tree, each 1 m along x; d is also seen from a, at x.
fn ring(x: f64) -> (Arc<Snapshot>, [NodeId; 4]) {
    let graph = Graph::new(schema().into(), 1);
    let made = graph.change(Time::ZERO, |edit| {
        let mut nodes = [None; 4];
        for (node, name) in nodes.iter_mut().zip(["a", "b", "c", "d"]) {
            let made = edit.add_node("Frame")?;
            edit.set(made, "name", name)?;
            *node = Some(made);
        }
        let nodes = nodes.map(|node| node.expect("a node"));
        for at in 0..3 {
            let ends = [nodes[at], nodes[at + 1]];
            link(edit, "RT", ends, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0])?;
        }
        let ends = [nodes[3], nodes[0]];
        link(edit, "seen_from", ends, [x, 0.0, 0.0, 0.0, 0.0, 0.5])?;
        Ok::<_, Error>(nodes)
    });
    let nodes = made.expect("a ring");
    (graph.snapshot(), nodes)
}

#[test]
fn a_pose_over_a_loop_is_that_of_the_shortest_chain() {
    let (now, [a, b, c, d]) = ring(3.25);
    let far = |to, from| now.pose(to, from).expect("a pose").translation[0];
    assert_eq!((far(a, d), far(a, c), far(b, c)), (3.25, 2.0, 1.0));
    let chain = now.chain(a, d).expect("a chain");
    let expected = "seen_from of d in a: translation (3.25, 0, 0), rotation (0, 0, 0.5)";
    assert_eq!(chain.operations(&now), [expected]);
    let way = now.chain(a, c).expect("a chain");
    let nodes: Vec<_> = way.links.iter().map(|link| (link.to, link.from)).collect();
    assert_eq!(nodes, [(a, b), (b, c)]);
    let expected = [
        "RT of b in a: translation (1, 0, 0), rotation (0, 0, 0)",
        "RT of c in b: translation (1, 0, 0), rotation (0, 0, 0)",
    ];
    assert_eq!(way.operations(&now), expected);
    let back = now.chain(c, b).expect("a chain").operations(&now);
    let expected = "inverse of RT of c in b: translation (1, 0, 0), rotation (0, 0, 0)";
    assert_eq!(back, [expected]);
    assert_eq!(now.chain(a, a).expect("a chain").links, []);
    // The tree alone is asked by frames.
    let frame = |node| now.frame(node).expect("a frame");
    let tree = now.between(frame(a), frame(d)).expect("a transform");
    assert_eq!(tree.translation.x, 3.0);
}

#[test]
fn the_other_chains_say_how_far_they_disagree() {
    let (now, [a, _, _, d]) = ring(3.25);
    let others: Vec<_> = now.other_chains(a, d).expect("chains").collect();
    let [(chain, apart)] = others.as_slice() else {
        panic!("{others:?}");
    };
    assert_eq!(chain.links.len(), 3);
    assert!((apart.distance - 0.25).abs() < 1e-12 && (apart.angle - 0.5).abs() < 1e-12);
    let loops: Vec<_> = now.loops().collect();
    let [found] = loops.as_slice() else {
        panic!("{loops:?}");
    };
    assert_eq!(
        now.edge(found.edge).expect("an edge").type_name(),
        "seen_from"
    );
    assert_eq!((found.chain.links.len(), found.disagreement), (3, *apart));
}

#[test]
fn nodes_that_nothing_connects_have_no_chain() {
    let graph = Graph::new(schema().into(), 1);
    let made = graph.change(Time::ZERO, |edit| {
        let (a, b) = (edit.add_node("Frame")?, edit.add_node("Frame")?);
        edit.add_edge("anything", a, b)?;
        // An edge without a pose leads nowhere.
        edit.add_edge("seen_from", a, b)?;
        Ok::<_, Error>((a, b))
    });
    let (a, b) = made.expect("two nodes");
    let now = graph.snapshot();
    assert_eq!(now.chain(a, b), Err(Error::NotConnected));
    assert!(now.other_chains(a, b).is_err());
    assert_eq!(now.loops().count(), 0);
}

/// All chains between two nodes, by trying all ways: lengths, and transforms.
fn all_chains(now: &Snapshot, to: NodeId, from: NodeId) -> Vec<(usize, Transform)> {
    let mut found = Vec::new();
    let mut open = vec![(vec![to], Transform::identity())];
    while let Some((way, so_far)) = open.pop() {
        let here = way[way.len() - 1];
        if here == from {
            found.push((way.len() - 1, so_far));
            continue;
        }
        for edge in now.edges() {
            let value = edge.get("pose").expect("a pose");
            let number = |at| value.number(at).expect("a number");
            let pose = Pose {
                translation: [0, 1, 2].map(number),
                rotation: [3, 4, 5].map(number),
            };
            let (parent, child) = match edge.type_name() {
                "RT" => (edge.from(), edge.to()),
                _ => (edge.to(), edge.from()),
            };
            for (near, far, step) in [
                (parent, child, Transform::of(&pose)),
                (child, parent, Transform::of(&pose).inverse()),
            ] {
                if near == here && !way.contains(&far) {
                    let way = way.iter().copied().chain([far]).collect();
                    open.push((way, so_far.then_inner(&step)));
                }
            }
        }
    }
    found
}

#[test]
fn random_loops_have_the_chains_that_a_search_of_all_finds() {
    let mut others = 0;
    for seed in 0..15 {
        let mut random = fastrand::Rng::with_seed(seed);
        let graph = Graph::new(schema().into(), 1);
        let made = graph.change(Time::ZERO, |edit| {
            let mut nodes = vec![edit.add_node("Frame")?];
            let mut pose = || [(); 6].map(|()| random.f64() * 2.0 - 1.0);
            let poses: Vec<Numbers> = (0..10).map(|_| pose()).collect();
            for pose in &poses[..6] {
                let node = edit.add_node("Frame")?;
                if random.u32(0..5) > 0 {
                    let parent = nodes[random.usize(0..nodes.len())];
                    link(edit, "RT", [parent, node], *pose)?;
                }
                nodes.push(node);
            }
            for pose in &poses[6..] {
                let ends = [0, 1].map(|_| nodes[random.usize(0..nodes.len())]);
                link(edit, "seen_from", ends, *pose)?;
            }
            Ok::<_, Error>(nodes)
        });
        let nodes = made.expect("a graph");
        let now = graph.snapshot();
        for to in &nodes {
            for from in &nodes {
                let all = all_chains(&now, *to, *from);
                let shortest = all.iter().map(|(length, _)| *length).min();
                let chain = now.chain(*to, *from);
                let length = chain.as_ref().ok().map(|chain| chain.links.len());
                assert_eq!(length, shortest, "seed {seed}");
                let Ok(chain) = chain else { continue };
                let is_one = |length: usize, transform: &Transform| {
                    all.iter().any(|(known, other)| {
                        let apart = Disagreement::of(transform, other);
                        *known == length && apart.distance < 1e-9 && apart.angle < 1e-9
                    })
                };
                assert!(is_one(chain.links.len(), &chain.transform()), "seed {seed}");
                for (other, apart) in now.other_chains(*to, *from).expect("chains") {
                    assert!(is_one(other.links.len(), &other.transform()), "seed {seed}");
                    let expected = Disagreement::of(&chain.transform(), &other.transform());
                    assert_eq!(apart, expected);
                    assert_ne!(other, chain);
                    others += 1;
                }
            }
        }
    }
    assert!(others > 300, "{others} other chains");
}
