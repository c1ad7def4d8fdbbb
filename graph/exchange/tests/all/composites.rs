//! MM05 of `RobMoSys` D3.2: a pose is one node or three, and the graph is the same afterwards.

use graph_exchange::{Document, check, graph_json};
use property_graph::schema::Entity;
use property_graph::{Edit, Error, Graph, NodeId, Time};
use rc_diagnostics::{Format, SourceMap, render};
use std::collections::HashMap;
use std::process::Command;

/// The edges in words. Each type is there once beside the two frames, so that equal words are
/// isomorphic graphs.
fn words(document: &Document) -> Vec<String> {
    let called = |node: &graph_exchange::Node| {
        let name = node.attributes.iter().find(|(name, ..)| name == "name");
        let name = name.and_then(|(_, value, _)| value.as_str());
        name.unwrap_or(&node.kind).to_owned()
    };
    let names: HashMap<_, _> = document.nodes.iter().map(|n| (n.id, called(n))).collect();
    let edges = document.edges.iter();
    let mut words: Vec<String> = edges
        .map(|edge| format!("{} {} {}", names[&edge.from], edge.kind, names[&edge.to]))
        .chain(names.values().cloned())
        .collect();
    words.sort();
    words
}

fn part(edit: &mut Edit, kind: &str, [hand, base]: [NodeId; 2]) -> Result<(), Error> {
    let part = edit.add_node(kind)?;
    edit.add_edge("of", part, hand)?;
    edit.add_edge("with_respect_to", part, base)?;
    Ok(())
}

#[test]
fn a_pose_is_the_same_whatever_was_there() {
    let starts: [&[&str]; 4] = [
        &[],
        &["Orientation"],
        &["Position", "Orientation"],
        &["Pose"],
    ];
    let (mut all, mut documents) = (Vec::new(), Vec::new());
    for start in starts {
        let schema = graph_language::builtin("geometry.gdsl").expect("a schema");
        let graph = Graph::new(schema.clone().into(), 1);
        let added = graph.change(Time::ZERO, |edit| {
            let mut frames = Vec::new();
            for name in ["hand", "base"] {
                let frame = edit.add_node("Frame")?;
                edit.set(frame, "name", name)?;
                frames.push(frame);
            }
            let [hand, base] = [frames[0], frames[1]];
            for kind in start {
                part(edit, kind, [hand, base])?;
            }
            let before = edit.snapshot().node_count();
            let ends = [("of", hand), ("with_respect_to", base)];
            let pose = edit.compose("Pose", &ends)?;
            let added = edit.snapshot().node_count() - before;
            // Once more changes nothing.
            assert_eq!(edit.compose("Pose", &ends)?, pose);
            assert_eq!(edit.snapshot().node_count(), before + added);
            Ok::<_, Error>(added)
        });
        assert_eq!(added, Ok(3 - start.len()), "{start:?}");
        let mut document = Document::of(&graph.snapshot());
        document.schema = Some("geometry.gdsl".to_owned());
        let mut sources = SourceMap::new();
        let source = sources.add("a.graph", graph_json::write(&document));
        let found = check(&document, &schema, &sources, source);
        assert_eq!(render(&sources, &found, Format::Short), "");
        all.push(words(&document));
        documents.push(document);
    }
    assert_eq!(all[0].len(), 5 + 8);
    assert!(all.iter().all(|words| *words == all[0]), "{all:#?}");
    isomorphic(&documents);
}

/// Whether networkx finds one graph in all of these.
fn isomorphic(documents: &[Document]) {
    let test = "a_pose_is_the_same_whatever_was_there (by networkx)";
    let Some(python) = rc_test_support::python::interpreter("networkx==3.6.1", test) else {
        return;
    };
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("graphs.json");
    let graphs = documents.iter().map(|document| {
        let nodes = document.nodes.iter();
        let edges = document.edges.iter();
        // Nothing but types: names and ids say nothing about the form.
        serde_json::json!({
            "nodes": nodes.map(|n| (n.id.count(), &n.kind)).collect::<Vec<_>>(),
            "edges": edges.map(|e| (e.from.count(), e.to.count(), &e.kind)).collect::<Vec<_>>(),
        })
    });
    let graphs = serde_json::Value::from(graphs.collect::<Vec<_>>());
    std::fs::write(&file, graphs.to_string()).expect("a file");
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/all/isomorphic.py");
    let output = Command::new(python).arg(script).arg(&file).output();
    let output = output.expect("python");
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{errors}");
    // Each of them is the first one, and without one of its edges it would not be.
    let expected = format!("{}\n", vec!["True False"; documents.len()].join("\n"));
    assert_eq!(String::from_utf8_lossy(&output.stdout), expected);
}

/// A relation in the other direction is another one.
#[test]
fn parts_of_other_frames_are_not_taken() {
    let schema = graph_language::builtin("geometry.gdsl").expect("a schema");
    let graph = Graph::new(schema.into(), 1);
    let made = graph.change(Time::ZERO, |edit| {
        let frames = ["hand", "base"].map(|name| {
            let frame = edit.add_node("Frame")?;
            edit.set(frame, "name", name)?;
            Ok::<_, Error>(frame)
        });
        let [hand, base] = frames;
        let (hand, base) = (hand?, base?);
        part(edit, "Position", [base, hand])?;
        edit.compose("Pose", &[("of", hand), ("with_respect_to", base)])
    });
    let pose = made.expect("a pose");
    let now = graph.snapshot();
    assert_eq!(now.count_of_type("Position"), 2);
    let composed_by = now.symbol("composed_by").expect("a relation");
    assert_eq!(now.out(pose, composed_by).count(), 2);
}

/// Parts are inherited, and a part that many have is added once.
#[test]
fn shared_and_inherited_parts_are_added_once() {
    const LEVELS: usize = 22;
    let mut schema = graph_language::builtin("geometry.gdsl").expect("a schema");
    let entity = |name: String, parent: &str, parts: Vec<String>| Entity {
        name,
        parent: Some(parent.to_owned()),
        parts,
        ..Entity::default()
    };
    let at = |level: usize, side: char| format!("Level{level}{side}");
    for level in 0..LEVELS {
        let parts = match level + 1 {
            LEVELS => Vec::new(),
            next => vec![at(next, 'a'), at(next, 'b')],
        };
        for side in ['a', 'b'] {
            let made = entity(at(level, side), "GeometricRelation", parts.clone());
            schema.entities.push(made);
        }
    }
    let stamped = entity("StampedPose".to_owned(), "Pose", Vec::new());
    schema.entities.push(stamped);
    let graph = Graph::new(schema.into(), 1);
    let made = graph.change(Time::ZERO, |edit| {
        let frame = edit.add_node("Frame")?;
        edit.set(frame, "name", "hand")?;
        edit.compose("Level0a", &[("of", frame), ("with_respect_to", frame)])?;
        let added = edit.snapshot().node_count();
        edit.compose("StampedPose", &[("of", frame), ("with_respect_to", frame)])?;
        Ok::<_, Error>(added)
    });
    // The frame, the first one, and two of each level below.
    assert_eq!(made, Ok(2 + 2 * (LEVELS - 1)));
    let now = graph.snapshot();
    assert_eq!(
        [
            now.count_of_type("Position"),
            now.count_of_type("Orientation")
        ],
        [1, 1]
    );
}
