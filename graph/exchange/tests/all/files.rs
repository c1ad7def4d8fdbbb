//! Written files are read again.

use graph_exchange::{Document, check, dsr, graph_json, graphml, innermodel, lenient};
use property_graph::{Error, Graph, Id, Schema, Time, Value};
use rc_diagnostics::{Format, SourceMap, render};
use std::sync::Arc;

/// A file that includes none.
struct NoFiles;

impl innermodel_language::Loader for NoFiles {
    fn read(&self, _: &std::path::Path) -> std::io::Result<String> {
        Err(std::io::ErrorKind::NotFound.into())
    }

    fn is_file(&self, _: &std::path::Path) -> bool {
        false
    }

    fn search(&self) -> &[std::path::PathBuf] {
        &[]
    }
}

fn all_values() -> Graph {
    let graph = Graph::new(Schema::anything().into(), 7);
    let made = graph.change(Time::ZERO, |edit| {
        let a = edit.add_node("thing")?;
        edit.set(a, "name", "a \"quoted\" näme\n")?;
        edit.set(a, "yes", true)?;
        edit.set(a, "count", -3_i64)?;
        edit.set(a, "large", i64::MAX)?;
        edit.set(a, "whole", 2.0)?;
        edit.set(a, "small", 1e-300)?;
        edit.set(a, "bytes", [0_u8, 255, 7].as_slice())?;
        edit.set(a, "numbers", [1.0, 2.5])?;
        edit.set(a, "none", Value::Floats(Arc::new([])))?;
        edit.set(a, "ints", Value::Ints([1, 2].into()))?;
        edit.set(a, "no_ints", Value::Ints(Arc::new([])))?;
        edit.set(a, "texts", Value::Texts([Arc::from("x")].into()))?;
        edit.set(a, "no_texts", Value::Texts(Arc::new([])))?;
        let b = edit.add_node("other")?;
        let edge = edit.add_edge("to", a, b)?;
        edit.set(edge, "weight", 0.5)?;
        edit.add_edge("to", a, b)?;
        edit.add_edge("to", b, b)?;
        Ok::<(), Error>(())
    });
    made.expect("a graph");
    graph
}

/// Without the places in files.
fn plain(document: &Document) -> Document {
    let graph = document
        .graph(Schema::anything().into(), 1)
        .expect("a graph");
    Document::of(&graph.snapshot())
}

#[test]
fn a_graph_is_written_and_read_equal() {
    let document = Document::of(&all_values().snapshot());
    let text = graph_json::write(&document);
    let mut sources = SourceMap::new();
    let source = sources.add("a.graph", text.as_str());
    let (read, found) = graph_json::read(&sources, source);
    assert_eq!(render(&sources, &found, Format::Short), "");
    let read = plain(&read.expect("a document"));
    assert_eq!(read, document);
    // Equal graphs give equal texts.
    assert_eq!(graph_json::write(&read), text);
}

#[test]
fn a_graph_of_dsr_is_written_and_read_equal() {
    let text = r#"{"DSRModel": {"symbols": {
        "100": {"id": "100", "name": "root", "type": "root", "attribute": {"level": {"type": 1, "value": 0}},
            "links": [{"src": "100", "dst": 200, "label": "RT", "linkAttribute": {
                "rt_translation": {"type": 3, "value": [1, 2.5, 0]},
                "rt_rotation_euler_xyz": {"type": 3, "value": [0, 0, 0.5]}}}]},
        "200": {"id": 200, "name": "robot", "type": "omnirobot", "links": [], "attribute": {
            "parent": {"type": 7, "value": "100"}, "colour": {"type": 0, "value": "Blue"},
            "on": {"type": 4, "value": true}, "image": {"type": 5, "value": [1, 2]}}}
    }}}"#;
    let mut sources = SourceMap::new();
    let source = sources.add("a.json", text);
    assert!(dsr::is_dsr(text));
    let (read, found) = dsr::read(&sources, source);
    assert_eq!(render(&sources, &found, Format::Short), "");
    let schema = graph_language::builtin("dsr.gdsl").expect("a schema");
    let graph = read.expect("a document").graph(lenient(&schema).into(), 1);
    let now = graph.expect("a graph").snapshot();
    let robot = now.named("robot").next().expect("the robot");
    let root = now.named("root").next().expect("the root");
    assert_eq!(now.get(robot, "parent"), Some(&Value::Int(100)));
    let pose = now.pose(root, robot).expect("a pose");
    assert_eq!(pose.translation, [1.0, 2.5, 0.0]);
    let (printed, lost) = dsr::write(&Document::of(&now));
    assert!(lost.is_empty(), "{lost:?}");
    let source = sources.add("b.json", printed.as_str());
    let (again, found) = dsr::read(&sources, source);
    assert_eq!(render(&sources, &found, Format::Short), "");
    let again = again.expect("a document").graph(lenient(&schema).into(), 1);
    let again = Document::of(&again.expect("a graph").snapshot());
    assert_eq!(again, Document::of(&now));
    assert_eq!(dsr::write(&again).0, printed);
}

/// Random bits of finite floats, a tenth of them subnormal, and the numbers at the borders.
fn random_floats(count: usize) -> Vec<f64> {
    let mut random = fastrand::Rng::with_seed(40);
    let borders = [
        0.0,
        -0.0,
        f64::MAX,
        f64::MIN,
        f64::MIN_POSITIVE,
        f64::EPSILON,
        f64::from_bits(1),
        f64::from_bits((1 << 52) - 1),
        0.1 + 0.2,
        9_007_199_254_740_993.0,
        1e23,
    ];
    let drawn = std::iter::repeat_with(|| {
        let bits = random.u64(..);
        // Without an exponent, a float is subnormal.
        let exponent = if random.u32(0..10) == 0 {
            0x7ff << 52
        } else {
            0
        };
        f64::from_bits(bits & !exponent)
    });
    let drawn = drawn.filter(|number| number.is_finite());
    borders.into_iter().chain(drawn).take(count).collect()
}

#[test]
fn floats_keep_all_their_bits_in_files() {
    let numbers = random_floats(100_000);
    let tiny = numbers.iter().filter(|number| number.is_subnormal());
    assert!(tiny.count() > 5_000);
    let graph = Graph::new(Schema::anything().into(), 1);
    let made = graph.change(Time::ZERO, |edit| {
        for some in numbers.chunks(1000) {
            let node = edit.add_node("thing")?;
            edit.set(node, "all", some)?;
            edit.set(node, "one", some[0])?;
        }
        Ok::<(), Error>(())
    });
    made.expect("a graph");
    let document = Document::of(&graph.snapshot());
    let bits = |read: &Document| -> Vec<u64> {
        let nodes = read.nodes.iter();
        let values = nodes.flat_map(|node| node.attributes.iter().map(|(_, value, _)| value));
        let bits = values.flat_map(|value| match value {
            Value::Float(number) => vec![number.to_bits()],
            Value::Floats(all) => all.iter().map(|number| number.to_bits()).collect(),
            _ => Vec::new(),
        });
        bits.collect()
    };
    let expected = bits(&document);
    assert_eq!(expected.len(), 100_100);
    let mut sources = SourceMap::new();
    let ours = sources.add("a.graph", graph_json::write(&document));
    let (read, found) = graph_json::read(&sources, ours);
    assert_eq!(render(&sources, &found, Format::Short), "");
    assert!(bits(&read.expect("a document")) == expected);
    let (text, lost) = dsr::write(&document);
    assert_eq!(lost.len(), 1, "{lost:?}");
    let theirs = sources.add("a.json", text);
    let (read, found) = dsr::read(&sources, theirs);
    assert_eq!(render(&sources, &found, Format::Short), "");
    assert!(bits(&plain(&read.expect("a document"))) == expected);
}

#[test]
fn graphml_has_all_nodes_and_edges() {
    let text = graphml::write(&Document::of(&all_values().snapshot()));
    assert_eq!(text.matches("<node ").count(), 2);
    assert_eq!(text.matches("<edge ").count(), 3);
    assert!(text.contains("a &quot;quoted&quot; näme&#10;</data>"));
    assert!(text.contains("attr.name=\"whole\" attr.type=\"double\""));
}

#[test]
fn an_innermodel_is_a_tree_of_frames() {
    let mut sources = SourceMap::new();
    let text = "<innerModel><transform id=\"base\" tx=\"1000\"><translation id=\"hand\" ty=\"500\"/></transform></innerModel>";
    let source = sources.add("a.xml", text);
    let loader = NoFiles;
    let (tree, _) = innermodel_language::load(&mut sources, &loader, source);
    let schema = graph_language::builtin("innermodel.gdsl").expect("a schema");
    let graph = innermodel::document(&tree).graph(schema.into(), 1);
    let now = graph.expect("a graph").snapshot();
    assert_eq!((now.node_count(), now.edge_count()), (3, 2));
    let hand = now.named("hand").next().expect("the hand");
    let root = now.named("root").next().expect("the root");
    let pose = now.pose(root, hand).expect("a pose");
    assert_eq!(pose.translation, [1.0, 0.5, 0.0]);
    assert_eq!(now.node(root).expect("there").id(), Id::new(1, 1));
}

/// Joints that have moved, bodies, devices, and what a mesh may not have.
#[test]
fn a_tree_of_innermodel_comes_back_from_its_graph() {
    let text = r##"<innerModel>
        <transform id="base" tx="1000" engine="bullet" mass="2">
            <joint id="shoulder" axis="z" ty="300" rx="0.1" min="-2" max="2">
                <prismaticJoint id="slide" axis="x" position="7" offset="5">
                    <mesh id="hand" file="hand.obj" tx="7" scale="2,2,2" collide="1" allowed="floor"/>
                </prismaticJoint>
                <rgbd id="eye" width="640" height="480" focal="500"/>
            </joint>
        </transform>
        <plane id="floor" size="4000,4000,10" texture="#8c8c8c" collide="1"/>
    </innerModel>"##;
    let mut sources = SourceMap::new();
    let source = sources.add("a.xml", text);
    let (tree, _) = innermodel_language::load(&mut sources, &NoFiles, source);
    let schema = graph_language::builtin("innermodel.gdsl").expect("a schema");
    let graph = innermodel::document(&tree)
        .graph(schema.into(), 1)
        .expect("a graph");
    // The pose of a joint has its position.
    let now = graph.snapshot();
    let [shoulder, slide] =
        ["shoulder", "slide"].map(|name| now.named(name).next().expect("a joint"));
    let [x, y, z] = now.pose(shoulder, slide).expect("a pose").translation;
    assert!((x - 0.012).abs() < 1e-12 && y.abs() < 1e-12 && z.abs() < 1e-12);
    let back = innermodel::tree(&now);
    let print = |tree: &innermodel_language::model::Document| innermodel_language::print(tree);
    assert_eq!(print(&back), print(&tree));

    // The pose of a joint that has turned has its position.
    let shoulder = graph.snapshot().named("shoulder").next().expect("a joint");
    let held = graph
        .snapshot()
        .in_edges(shoulder, None)
        .next()
        .expect("an edge")
        .edge_id();
    let turned = property_graph::Transform::about(innermodel_language::model::Axis::Z, 0.5);
    let before = graph
        .snapshot()
        .get(held, "pose")
        .and_then(|v| v.numbers().map(|n| n.to_vec()));
    let before: [f64; 6] = before.expect("a pose").try_into().expect("six numbers");
    let [x, y, z, rx, ry, rz] = before;
    let pose = property_graph::Pose::new(x, y, z, rx, ry, rz);
    let after = property_graph::Transform::of(&pose)
        .then_inner(&turned)
        .pose();
    let ([x, y, z], [rx, ry, rz]) = (after.translation, after.rotation);
    let made = graph.change(Time::ZERO, |edit| {
        edit.set(held, "pose", [x, y, z, rx, ry, rz])?;
        edit.set(shoulder, "position", 0.5)
    });
    made.expect("a change");
    let moved = innermodel::tree(&graph.snapshot());
    let joint = |tree: &innermodel_language::model::Document| {
        tree.nodes[tree.find("shoulder").expect("a joint")].pose
    };
    let (found, expected) = (joint(&moved), joint(&tree));
    for at in 0..3 {
        assert!((found.translation[at] - expected.translation[at]).abs() < 1e-9);
        assert!((found.rotation[at] - expected.rotation[at]).abs() < 1e-9);
    }
}

/// A tree whose ids are used twice is none: ids that are made leave the names of others free.
#[test]
fn ids_of_a_tree_are_used_once() {
    let schema = graph_language::builtin("dsr.gdsl").expect("a schema");
    let graph = Graph::new(schema.into(), 3);
    let made = graph.change(Time::ZERO, |edit| {
        let room = edit.add_node("room")?;
        edit.set(room, "name", "room")?;
        for name in ["table", "table_body", "cup", "cup", "odd\u{fffe}"] {
            let object = edit.add_node("object")?;
            edit.set(object, "name", name)?;
            for side in ["width", "depth", "height"] {
                edit.set(object, side, 600_i64)?;
            }
            let edge = edit.add_edge("RT", room, object)?;
            edit.set(edge, "rt_translation", [1.0, 2.0, 3.0])?;
            edit.set(edge, "rt_rotation_euler_xyz", [0.0; 3])?;
        }
        Ok::<(), Error>(())
    });
    made.expect("a graph");
    let now = graph.snapshot();
    let cup = now.named("cup").next().expect("a cup");
    let taken = innermodel::tree(&now).nodes.iter().find_map(|node| {
        let is_cup = node.id.starts_with("cup#") && !node.id.ends_with("_body");
        is_cup.then(|| node.id.clone())
    });
    let renamed = graph.change(Time::ZERO, |edit| {
        let other = edit.add_node("object")?;
        edit.set(other, "name", taken.as_deref().expect("a cup"))?;
        let room = edit.snapshot().named("room").next().expect("a room");
        let edge = edit.add_edge("RT", room, other)?;
        edit.set(edge, "rt_translation", [0.0; 3])?;
        edit.set(edge, "rt_rotation_euler_xyz", [0.0; 3])?;
        edit.set(cup, "level", 1_i64)
    });
    renamed.expect("a change");
    let tree = innermodel::tree(&graph.snapshot());
    let text = innermodel_language::print(&tree);
    let mut sources = SourceMap::new();
    let source = sources.add("world.xml", text);
    let (back, found) = innermodel_language::load(&mut sources, &NoFiles, source);
    assert!(!found.has_errors(), "{found:?}");
    assert_eq!(back.nodes.len(), 1 + 5 * 2 + 1);
    assert!(back.find("table_body").is_some() && back.find("table_body_").is_some());
}

/// A joint whose limits exclude 0 starts at the nearest end, as in the library of `InnerModel`.
#[test]
fn joints_start_within_their_limits() {
    let text = r#"<innerModel>
        <joint id="wrist" axis="z" tx="200" rx="0.3" min="0.5" max="2">
            <prismaticJoint id="finger" axis="y" position="90" min="10" max="40"/>
        </joint>
    </innerModel>"#;
    let mut sources = SourceMap::new();
    let source = sources.add("a.xml", text);
    let (tree, _) = innermodel_language::load(&mut sources, &NoFiles, source);
    let schema = graph_language::builtin("innermodel.gdsl").expect("a schema");
    let graph = innermodel::document(&tree).graph(schema.into(), 1);
    let now = graph.expect("a graph").snapshot();
    let named = |name| now.named(name).next().expect("a node");
    let [root, wrist, finger] = ["root", "wrist", "finger"].map(named);
    assert_eq!(now.get(wrist, "position"), Some(&0.5.into()));
    assert_eq!(now.get(finger, "position"), Some(&40.0.into()));
    let turned = property_graph::Transform::about(innermodel_language::model::Axis::Z, 0.5);
    let place = property_graph::Pose::new(0.2, 0.0, 0.0, 0.3, 0.0, 0.0);
    let expected = property_graph::Transform::of(&place).then_inner(&turned);
    let found = now.pose(root, wrist).expect("a pose");
    let found = property_graph::Transform::of(&found);
    for (found, expected) in found.rotation.iter().zip(expected.rotation.iter()) {
        assert!((found - expected).abs() < 1e-12);
    }
    let [x, y, z] = now.pose(wrist, finger).expect("a pose").translation;
    assert!(x.abs() < 1e-12 && (y - 0.04).abs() < 1e-12 && z.abs() < 1e-12);
    let back = innermodel::tree(&now);
    let wrist = back.nodes[back.find("wrist").expect("a joint")].pose;
    assert!((wrist.rotation[0] - 0.3).abs() < 1e-12 && wrist.rotation[2].abs() < 1e-12);
}

/// Frames of ROS and of DSR point elsewhere than those of InnerModel, and names may be there twice.
#[test]
fn frames_of_other_graphs_are_turned_into_a_tree() {
    let schema = graph_language::builtin("geometry.gdsl").expect("a schema");
    let graph = Graph::new(schema.into(), 3);
    let made = graph.change(Time::ZERO, |edit| {
        let mut frames = Vec::new();
        for name in ["room", "door", "door", "root"] {
            let frame = edit.add_node("Frame")?;
            edit.set(frame, "name", name)?;
            frames.push(frame);
        }
        for (parent, child) in [(0, 1), (0, 2), (1, 3)] {
            let edge = edit.add_edge("RT", frames[parent], frames[child])?;
            edit.set(edge, "pose", [1.0, 2.0, 3.0, 0.0, 0.0, 0.5])?;
        }
        Ok::<(), Error>(())
    });
    made.expect("a graph");
    let tree = innermodel::tree(&graph.snapshot());
    let ids: Vec<&str> = tree.nodes.iter().map(|node| node.id.as_str()).collect();
    assert_eq!(ids.len(), 4, "{ids:?}");
    assert_eq!(ids[0], "room");
    assert!(ids[1].starts_with("door#3:") && ids[1] != ids[3], "{ids:?}");
    assert!(ids.iter().any(|id| id.starts_with("root#3:")), "{ids:?}");
    // Ahead 1 m, left 2 m, up 3 m; a turn to the left about up is one to the left about y.
    assert_eq!(tree.nodes[1].pose.translation, [-2000.0, 3000.0, 1000.0]);
    let [rx, ry, rz] = tree.nodes[1].pose.rotation;
    assert!(
        rx.abs() < 1e-12 && rz.abs() < 1e-12 && (ry + 0.5).abs() < 1e-12,
        "{ry}"
    );

    let schema = graph_language::builtin("dsr.gdsl").expect("a schema");
    let graph = Graph::new(schema.into(), 3);
    let made = graph.change(Time::ZERO, |edit| {
        let (room, table) = (edit.add_node("room")?, edit.add_node("object")?);
        edit.set(room, "name", "room")?;
        edit.set(table, "name", "table")?;
        for (name, side) in [("width", 800_i64), ("depth", 600), ("height", 700)] {
            edit.set(table, name, side)?;
        }
        let edge = edit.add_edge("RT", room, table)?;
        edit.set(edge, "rt_translation", [1.0, 2.0, 3.0])?;
        edit.set(edge, "rt_rotation_euler_xyz", [0.0; 3])
    });
    made.expect("a graph");
    let tree = innermodel::tree(&graph.snapshot());
    let ids: Vec<&str> = tree.nodes.iter().map(|node| node.id.as_str()).collect();
    assert_eq!(ids, ["room", "table", "table_body"]);
    assert_eq!(tree.nodes[1].pose.translation, [1000.0, 3000.0, 2000.0]);
    let innermodel_language::model::Kind::Plane(plane) = &tree.nodes[2].kind else {
        panic!("{:?}", tree.nodes[2]);
    };
    assert_eq!(plane.size, [800.0, 700.0, 600.0]);
}

/// Two parents are not a tree. Their poses are kept, and the shortest chain of them answers.
#[test]
fn a_file_whose_tree_has_a_loop_keeps_its_poses() {
    let mut document = Document::default();
    let graph = Graph::new(Schema::anything().into(), 1);
    let made = graph.change(Time::ZERO, |edit| {
        let nodes = [
            edit.add_node("Frame")?,
            edit.add_node("Frame")?,
            edit.add_node("Frame")?,
        ];
        for (from, to, x) in [(0, 1, 1.0), (1, 2, 1.0), (0, 2, 2.5)] {
            let edge = edit.add_edge("RT", nodes[from], nodes[to])?;
            edit.set(edge, "pose", [x, 0.0, 0.0, 0.0, 0.0, 0.0])?;
        }
        document = Document::of(edit.snapshot());
        Ok::<(), Error>(())
    });
    made.expect("a graph");
    let schema = graph_language::builtin("geometry.gdsl").expect("a schema");
    assert!(document.graph(schema.clone().into(), 1).is_err());
    let now = document.kept(&schema, 1).expect("a graph").snapshot();
    let node = |count| now.find_node(Id::new(1, count)).expect("a node");
    let pose = now.pose(node(1), node(3)).expect("a pose");
    assert_eq!(pose.translation, [2.5, 0.0, 0.0]);
    assert_eq!(
        now.other_chains(node(1), node(3)).expect("chains").count(),
        1
    );
    assert_eq!(now.loops().count(), 3);
}

/// An edge may start and end at edges, also at those that come later in the file. DSR has no such edges,
/// and `GraphML` has a node for such an edge.
#[test]
fn edges_to_edges_are_written_and_read() {
    let text = r#"{
  "nodes": [
    {"id": "1:1", "type": "Frame", "attributes": {"name": "cup"}},
    {"id": "1:2", "type": "Frame", "attributes": {"name": "table"}}
  ],
  "edges": [
    {"id": "1:3", "type": "about", "from": "1:4", "to": "1:5"},
    {"id": "1:4", "type": "about", "from": "1:1", "to": "1:5"},
    {"id": "1:5", "type": "is_at", "from": "1:1", "to": "1:2", "attributes": {"since": 1.5}}
  ]
}
"#;
    let mut sources = SourceMap::new();
    let source = sources.add("a.graph", text);
    let document = graph_json::read(&sources, source).0.expect("a document");
    let graph = document
        .graph(Schema::anything().into(), 1)
        .expect("a graph");
    let now = graph.snapshot();
    assert_eq!((now.node_count(), now.edge_count()), (2, 3));
    assert_eq!(now.promoted().count(), 2);
    assert_eq!(graph_json::write(&Document::of(&now)), text);
    let (dsr, lost) = dsr::write(&document);
    assert_eq!(dsr.matches("\"label\"").count(), 1);
    assert!(
        lost.iter().any(|text| text.contains("no edges to edges")),
        "{lost:?}"
    );
    let graphml = graphml::write(&document);
    assert_eq!(graphml.matches("<node ").count(), 4);
    // Edges at whose ends there is nothing but themselves.
    let round = text.replace("\"to\": \"1:2\"", "\"to\": \"1:3\"");
    let source = sources.add("b.graph", round);
    let document = graph_json::read(&sources, source).0.expect("a document");
    let error = document
        .graph(Schema::anything().into(), 1)
        .expect_err("a round");
    assert!(matches!(error, Error::UnknownId(_)), "{error}");
}

/// The oldest files of DSR have poses with other names: they are read as poses, and written with the
/// present names.
#[test]
fn poses_of_the_oldest_files_of_dsr_are_poses() {
    let oldest = r#"{"DSRModel": {"symbols": {
"1": {"id": 1, "name": "world", "type": "root", "links": [
{"src": 1, "dst": 2, "label": "RT", "linkAttribute": {
"translation": {"type": 3, "value": [2, 0, 0]}, "rotation_euler_xyz": {"type": 3, "value": [0, 0, 0]}}}]},
"2": {"id": 2, "name": "room", "type": "room", "links": [
{"src": 2, "dst": 3, "label": "RT", "linkAttribute": {
"translation": {"type": 3, "value": [0, 3, 500]}, "rotation_euler_xyz": {"type": 3, "value": "none"}}},
{"src": 2, "dst": 3, "label": "has", "linkAttribute": {"translation": {"type": 3, "value": [1]}}}]},
"3": {"id": 3, "name": "table", "type": "mesh", "links": []}
}}}"#;
    let schema = graph_language::builtin("dsr.gdsl").expect("a schema");
    let mut sources = SourceMap::new();
    let source = sources.add("oldest.json", oldest);
    let (document, mut found) = dsr::read(&sources, source);
    let document = document.expect("a document");
    found.extend(check(&document, &schema, &sources, source));
    // Each finding is at the name that the file has.
    assert_eq!(
        render(&sources, &found, Format::Short),
        "\
oldest.json:4:16: warning[older-name]: `translation` is read as `rt_translation`, its present name (2 times)
oldest.json:4:71: warning[older-name]: `rotation_euler_xyz` is read as `rt_rotation_euler_xyz`, its present name (2 times)
oldest.json:7:16: error[wrong-value]: `rt_translation` of `RT` is in -100:100 m, found 500 (the schema says metres, and the value fits if it is in millimetres)
oldest.json:7:73: error[wrong-json]: expected a value of DSR's type 3 (float vector), found a string
oldest.json:8:71: warning[unknown-attribute]: `has` has no attribute `translation`
"
    );
    let right = oldest.replace("\"none\"", "[0, 0, 0]");
    let source = sources.add("right.json", right);
    let document = dsr::read(&sources, source).0.expect("a document");
    let now = document.kept(&schema, 1).expect("a graph").snapshot();
    let [world, table] = ["world", "table"].map(|name| now.named(name).next().expect("a node"));
    let pose = now.pose(world, table).expect("a pose");
    assert_eq!(pose.translation, [2.0, 3.0, 500.0]);
    let (printed, _) = dsr::write(&document);
    let source = sources.add("printed.json", printed);
    let (_, found) = dsr::read(&sources, source);
    assert_eq!(render(&sources, &found, Format::Short), "");
}
