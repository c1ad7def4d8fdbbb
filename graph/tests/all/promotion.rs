//! Edges to edges: an edge is a node to those that refer to it (MM06 of `RobMoSys` D3.2).

use property_graph::schema::{Attribute, Comparison, Entity, Kind, Port, Relation, Rule};
use property_graph::{Change, EdgeId, Element, Error, Graph, Id, NodeId, Schema, Snapshot, Time};
use std::collections::{BTreeMap, BTreeSet};

fn port(name: &str, entity: &str, max: Option<u32>) -> Port {
    Port {
        name: name.to_owned(),
        entity: entity.to_owned(),
        min: u32::from(entity == "Pose"),
        max,
    }
}

/// Frames, where they are, and who says so.
fn schema() -> Schema {
    let entity = |name: &str| Entity {
        name: name.to_owned(),
        ..Entity::default()
    };
    let relation = |name: &str, ports: [Port; 2], promotes: Option<&str>| Relation {
        name: name.to_owned(),
        ports: ports.into(),
        promotes: promotes.map(str::to_owned),
        ..Relation::default()
    };
    let mut is_at = relation(
        "is_at",
        [port("what", "Frame", None), port("where", "Frame", None)],
        Some("Pose"),
    );
    let number = |name: &str| Attribute {
        name: name.to_owned(),
        kind: Kind::Float,
        unit: None,
        range: None,
        optional: true,
        key: false,
        history: None,
        doc: Vec::new(),
    };
    is_at.attributes.push(number("since"));
    let mut device = entity("Device");
    device.attributes.push(number("until"));
    let said_by = [
        port("pose", "Pose", Some(1)),
        port("device", "Device", None),
    ];
    let near = [port("a", "Frame", None), port("b", "Frame", None)];
    Schema {
        entities: vec![entity("Frame"), entity("Pose"), device],
        relations: vec![
            is_at,
            relation("said_by", said_by, None),
            relation("near", near, None),
        ],
        rules: vec![Rule {
            relation: "said_by".to_owned(),
            left: (0, "since".to_owned()),
            comparison: Comparison::LessOrEqual,
            right: (1, "until".to_owned()),
            message: "too late".to_owned(),
        }],
        ..Schema::default()
    }
}

struct Scene {
    graph: Graph,
    is_at: EdgeId,
    camera: NodeId,
}

fn scene() -> Scene {
    let graph = Graph::new(schema().into(), 1);
    let (is_at, camera) = graph
        .change(Time::ZERO, |edit| {
            let [cup, table, camera] = ["Frame", "Frame", "Device"].map(|kind| edit.add_node(kind));
            let edge = edit.add_edge("is_at", cup?, table?)?;
            edit.set(edge, "since", 2.0)?;
            Ok::<_, Error>((edge, camera?))
        })
        .expect("a scene");
    Scene {
        graph,
        is_at,
        camera,
    }
}

/// What somebody sees who asks for nodes and edges, but not for what refers to edges.
fn seen(graph: &Snapshot) -> (usize, usize, Vec<Id>, Vec<String>) {
    let nodes = graph.nodes().map(|node| node.id()).collect();
    let edges = graph.edges().filter(|edge| edge.type_name() == "is_at");
    let edges =
        edges.map(|edge| format!("{:?} {:?} {:?}", edge.from(), edge.to(), edge.get("since")));
    (
        graph.node_count(),
        graph.count_of_type("Pose"),
        nodes,
        edges.collect(),
    )
}

#[test]
fn an_edge_is_a_node_while_another_one_refers_to_it() {
    let scene = scene();
    let before = scene.graph.snapshot();
    let said_by = scene
        .graph
        .change(Time::ZERO, |edit| {
            let pose = edit.node_of(scene.is_at)?;
            assert_eq!(edit.node_of(scene.is_at)?, pose);
            edit.add_edge("said_by", pose, scene.camera)
        })
        .expect("an edge to an edge");
    let now = scene.graph.snapshot();
    assert_eq!(seen(&now), seen(&before));
    let pose = now.node_of(scene.is_at).expect("a node");
    assert_eq!(now.stands_for(pose), Some(scene.is_at));
    let node = now.node(pose).expect("a node");
    assert_eq!(
        (node.type_name(), node.get("since")),
        ("is_at", Some(&2.0.into()))
    );
    assert_eq!(node.id(), now.edge(scene.is_at).expect("an edge").id());
    assert_eq!(now.find(node.id()), Some(Element::Edge(scene.is_at)));
    let [said, pose_type] = ["said_by", "Pose"].map(|name| now.symbol(name).expect("a name"));
    assert_eq!(now.out(pose, said).next(), Some(scene.camera));
    assert!(now.is_a(node.kind(), pose_type));
    // Only the edge is a change: the node is the edge.
    assert_eq!(now.since(&before), [Change::EdgeAdded(said_by)]);
    // An attribute of one is that of the other.
    let set = scene
        .graph
        .change(Time::ZERO, |edit| edit.set(pose, "since", 3.0));
    set.expect("a change");
    let later = scene.graph.snapshot();
    assert_eq!(later.get(scene.is_at, "since"), Some(&3.0.into()));
    assert_eq!(later.get(pose, "since"), Some(&3.0.into()));
    assert_eq!(later.since(&now).len(), 1);
    // Without a reference, only the edge is left.
    let removed = scene
        .graph
        .change(Time::ZERO, |edit| edit.remove_edge(said_by));
    removed.expect("a change");
    let last = scene.graph.snapshot();
    assert_eq!(last.node_of(scene.is_at), None);
    assert_eq!(last.node(pose).err(), Some(Error::Removed));
    assert_eq!(last.get(scene.is_at, "since"), Some(&3.0.into()));
    assert_eq!(last.promoted().count(), 0);
    // An unused node was never there.
    let unused = scene
        .graph
        .change(Time::ZERO, |edit| edit.node_of(scene.is_at));
    assert!(
        scene
            .graph
            .snapshot()
            .node(unused.expect("a node"))
            .is_err()
    );
}

#[test]
fn the_schema_says_what_an_edge_is_to_others() {
    let scene = scene();
    let add = |relation: &str| {
        scene.graph.change(Time::ZERO, |edit| {
            let pose = edit.node_of(scene.is_at)?;
            edit.add_edge(relation, pose, scene.camera)
        })
    };
    let error = add("near").expect_err("no frame");
    assert_eq!(
        error.to_string(),
        "port `a` of `near` is for Frame, found is_at"
    );
    add("said_by").expect("a pose");
    let error = add("said_by").expect_err("a second one");
    assert_eq!(
        error.to_string(),
        "a node of `is_at` is 2 times `pose` of `said_by`; expected 1:1"
    );
    // A relation that promotes nothing is never an end.
    let error = scene.graph.change(Time::ZERO, |edit| {
        let [a, b] = [edit.add_node("Frame")?, edit.add_node("Frame")?];
        let near = edit.add_edge("near", a, b)?;
        let near = edit.node_of(near)?;
        edit.add_edge("said_by", near, scene.camera)
    });
    let expected = "port `pose` of `said_by` is for Pose, found near";
    assert_eq!(error.expect_err("no pose").to_string(), expected);
    // With an edge, those at it go.
    let removed = scene
        .graph
        .change(Time::ZERO, |edit| edit.remove_edge(scene.is_at));
    removed.expect("a change");
    assert_eq!(scene.graph.snapshot().edge_count(), 0);
}

#[test]
fn a_rule_holds_also_when_an_edge_at_an_end_changes_later() {
    let scene = scene();
    let said = scene.graph.change(Time::ZERO, |edit| {
        let pose = edit.node_of(scene.is_at)?;
        edit.set(scene.camera, "until", 4.0)?;
        edit.add_edge("said_by", pose, scene.camera)
    });
    said.expect("a change");
    let set = |since: f64| {
        let change = |edit: &mut property_graph::Edit| edit.set(scene.is_at, "since", since);
        scene.graph.change(Time::ZERO, change)
    };
    set(3.0).expect("early enough");
    assert_eq!(
        set(5.0).expect_err("a broken rule").to_string(),
        "too late: 5 <= 4 does not hold for an edge of `said_by`"
    );
}

/// Ids of nodes, and ends of edges by id.
#[derive(Clone, Default)]
struct Model {
    nodes: BTreeSet<Id>,
    edges: BTreeMap<Id, [Id; 2]>,
}

impl Model {
    fn remove(&mut self, id: Id) {
        self.nodes.remove(&id);
        self.edges.remove(&id);
        let at = |ends: &[Id; 2]| ends.contains(&id);
        while let Some(other) = self.edges.iter().find(|(_, e)| at(e)).map(|(id, _)| *id) {
            self.remove(other);
        }
    }
}

/// Random graphs with edges to edges to edges, beside a list of ids.
#[test]
fn random_edges_to_edges_are_those_of_a_list() {
    let mut rng = fastrand::Rng::with_seed(4);
    let mut deepest = 0;
    for _ in 0..20 {
        let graph = Graph::new(Schema::anything().into(), 1);
        let mut model = Model::default();
        for _ in 0..60 {
            let before = model.clone();
            let result = graph.change(Time::ZERO, |edit| {
                for _ in 0..rng.usize(1..6) {
                    let all: Vec<Id> = model
                        .nodes
                        .iter()
                        .chain(model.edges.keys())
                        .copied()
                        .collect();
                    if all.len() < 2 || rng.usize(..5) == 0 {
                        let node = edit.add_node("n")?;
                        model.nodes.insert(edit.snapshot().node(node)?.id());
                    } else if rng.usize(..6) == 0 {
                        let id = all[rng.usize(..all.len())];
                        match edit.snapshot().find(id) {
                            Some(Element::Node(node)) => edit.remove_node(node)?,
                            Some(Element::Edge(edge)) if rng.bool() => edit.remove_edge(edge)?,
                            Some(Element::Edge(edge)) => {
                                let node = edit.node_of(edge)?;
                                edit.remove_node(node)?;
                            }
                            None => panic!("{id:?} is missing"),
                        }
                        model.remove(id);
                    } else {
                        let ends = [0, 1].map(|_| all[rng.usize(..all.len())]);
                        let (from, to) = (edit.end(ends[0])?, edit.end(ends[1])?);
                        let edge = edit.add_edge("e", from, to)?;
                        let id = edit.snapshot().edge(edge)?.id();
                        model.edges.insert(id, ends);
                    }
                }
                // A change that fails leaves no trace.
                if rng.usize(..4) == 0 {
                    Err(Error::NoFrame)
                } else {
                    Ok(())
                }
            });
            if result.is_err() {
                model = before;
            }
            let now = graph.snapshot();
            let nodes: BTreeSet<Id> = now.nodes().map(|node| node.id()).collect();
            assert_eq!(nodes, model.nodes);
            assert_eq!(now.node_count(), nodes.len());
            let id = |node| now.node(node).expect("an end").id();
            let edges = now
                .edges()
                .map(|edge| (edge.id(), [id(edge.from()), id(edge.to())]));
            let edges: BTreeMap<Id, [Id; 2]> = edges.collect();
            assert_eq!(edges, model.edges);
            let ends: BTreeSet<Id> = model.edges.values().flatten().copied().collect();
            let promoted: BTreeSet<Id> = now.promoted().map(|edge| edge.id()).collect();
            let expected = model.edges.keys().filter(|id| ends.contains(id));
            assert_eq!(promoted, expected.copied().collect());
            deepest = deepest.max(promoted.len());
        }
    }
    assert!(deepest > 10, "{deepest}");
}
