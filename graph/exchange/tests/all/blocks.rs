//! Attributes that hold data prototypes: one value in several representations.

use graph_exchange::{Document, check, graph_json, migrate};
use property_graph::schema::Kind;
use property_graph::{Change, Error, Graph, Id, NodeId, Sample, Schema, Time, Value};
use rc_diagnostics::{Format, SourceMap, render};
use rc_syntax::MemoryLoader;
use std::sync::Arc;
use std::thread::ScopedJoinHandle;

pub(crate) const PROTOTYPES: &str = r"
algebraic xyz :: Scalar{x, y, z}
algebraic four :: Vector{4}
algebraic nine :: Matrix{3, 3}
units millimetres :: qudt, xyz { x = mm, y = mm, z = mm }
units metres :: qudt, xyz { x = m, y = m, z = m }
axes body :: ahead, left, up
axes camera :: right, down, ahead
dproto seen :: geometry
{
    semantic = Position coord = cartesian algebraic = xyz ddr = :: c99{double[3]}
    dr = { 0 = x, 1 = y, 2 = z } units = millimetres axes = camera
}
dproto place :: geometry
{
    semantic = Position coord = cartesian algebraic = xyz ddr = :: c99{double[3]}
    dr = { 0 = x, 1 = y, 2 = z } units = metres axes = body
}
dproto stamped :: geometry
{
    semantic = Pose composes = { Position = seen, Orientation = turn }
}
dproto turn :: geometry
{
    semantic = Orientation coord = quaternion algebraic = four ddr = :: c99{double[4]}
    dr = { 0 = 0, 1 = 1, 2 = 2, 3 = 3 }
}
dproto turn_matrix :: geometry
{
    semantic = Orientation coord = rot_matrix algebraic = nine ddr = :: c99{double[9]}
    dr = { 0 = {0,0}, 1 = {0,1}, 2 = {0,2}, 3 = {1,0}, 4 = {1,1}, 5 = {1,2}, 6 = {2,0}, 7 = {2,1}, 8 = {2,2} }
}
";

const DOMAIN: &str = r#"import "all.dproto";
Domain seeing
{
    entity Sighting
    {
        name string optional;
        where dproto place history 10s;
        raw dproto seen consistency where;
        turn dproto turn optional;
        matrix dproto turn_matrix consistency turn;
        picture topic "RoboCompCamera::TImage" optional;
        thumb bytes optional;
    };
};
"#;

pub(crate) fn schema_of(domain: &str, prototypes: &str) -> Arc<Schema> {
    let mut sources = SourceMap::new();
    let source = sources.add("a.gdsl", domain);
    let loader = MemoryLoader::new([("all.dproto", prototypes)]);
    let (schema, found) = graph_language::load(&mut sources, &loader, source);
    assert_eq!(render(&sources, &found, Format::Short), "");
    Arc::new(schema.expect("a schema"))
}

fn graph() -> (Graph, NodeId) {
    let graph = Graph::new(schema_of(DOMAIN, PROTOTYPES), 1);
    let sighting = graph.change(Time::ZERO, |edit| {
        let sighting = edit.add_node("Sighting")?;
        edit.set(sighting, "where", [1.0, 2.0, 3.0])?;
        Ok::<_, Error>(sighting)
    });
    (graph, sighting.expect("a sighting"))
}

fn numbers(graph: &Graph, node: NodeId, name: &str) -> Vec<f64> {
    let now = graph.snapshot();
    let value = now.get(node, name).unwrap_or_else(|| panic!("{name}"));
    value.numbers().expect("numbers").into_owned()
}

fn set(graph: &Graph, node: NodeId, name: &str, value: impl Into<Value>) -> Result<(), Error> {
    graph.change(Time::ZERO, |edit| edit.set(node, name, value))
}

#[test]
fn several_attributes_are_one_value() {
    let (graph, node) = graph();
    // A camera looks ahead: x right, y down, z ahead, in millimetres.
    assert_eq!(numbers(&graph, node, "raw"), [-2000.0, -3000.0, 1000.0]);
    let before = graph.snapshot();
    set(&graph, node, "raw", [500.0, 0.0, 4000.0]).expect("a change");
    assert_eq!(numbers(&graph, node, "where"), [4.0, -0.5, 0.0]);
    // A set value stays as it was set, and is there once.
    assert_eq!(numbers(&graph, node, "raw"), [500.0, 0.0, 4000.0]);
    let now = graph.snapshot();
    let listed: Vec<&str> = now
        .node(node)
        .expect("a node")
        .attributes()
        .map(|(n, _)| n)
        .collect();
    assert_eq!(listed, ["raw"]);
    // The old version has the old value in both.
    let old = before.get(node, "raw").expect("a value");
    assert_eq!(old, &Value::from([-2000.0, -3000.0, 1000.0]));
    // Both are other ones now.
    let changes = now.since(&before);
    let changed = changes.iter().filter_map(|change| match change {
        Change::Attribute(_, symbol) => Some(now.text(*symbol)),
        _ => None,
    });
    let mut changed: Vec<&str> = changed.collect();
    changed.sort_unstable();
    assert_eq!(changed, ["raw", "where"]);
    // It is required, in any representation.
    let refused = graph.change(Time::ZERO, |edit| edit.unset(node, "where"));
    assert!(matches!(refused, Err(Error::Missing { .. })), "{refused:?}");
    // The last one counts.
    let both = [("raw", [0.0, 0.0, 0.0]), ("where", [7.0, 8.0, 9.0])];
    graph
        .change(Time::ZERO, |edit| edit.set_all(node, both))
        .expect("a change");
    assert_eq!(numbers(&graph, node, "where"), [7.0, 8.0, 9.0]);
    assert_eq!(numbers(&graph, node, "raw"), [-8000.0, -9000.0, 7000.0]);
}

#[test]
fn a_representation_is_made_once() {
    let (graph, node) = graph();
    let now = graph.snapshot();
    let first: *const Value = now.get(node, "raw").expect("a value");
    let again: *const Value = now.get(node, "raw").expect("a value");
    assert_eq!(first, again);
    // Later versions in which it is the same have it, too.
    set(&graph, node, "name", "cup").expect("a change");
    let later = graph.snapshot();
    let later: *const Value = later.get(node, "raw").expect("a value");
    assert_eq!(first, later);
}

#[test]
fn the_history_has_what_was_set_as_another_attribute() {
    let (graph, node) = graph();
    let second = Time::from_secs(1);
    graph
        .change(second, |edit| edit.set(node, "raw", [0.0, 0.0, 1000.0]))
        .expect("a change");
    let expected = [
        (Time::ZERO, Value::from([1.0, 2.0, 3.0])),
        (second, Value::from([1.0, 0.0, 0.0])),
    ];
    assert_eq!(graph.history_of(node, "where"), expected);
}

/// How often each reader reads while the writer goes on.
const READS: usize = 2000;

/// A writer sets one attribute and then the other one; readers see the same value in both.
#[test]
fn no_reader_sees_two_versions() {
    let (graph, node) = graph();
    std::thread::scope(|scope| {
        let readers = [0; 3].map(|_| {
            scope.spawn(|| {
                for _ in 0..READS {
                    let now = graph.snapshot();
                    let place = now.get(node, "where").and_then(|v| v.number(0));
                    let raw = now.get(node, "raw").and_then(|v| v.number(2));
                    assert_eq!(raw, place.map(|place| place * 1000.0));
                }
            })
        });
        let mut at = 0_u32;
        while at < 2000 || !readers.iter().all(ScopedJoinHandle::is_finished) {
            let number = f64::from(at);
            let set = if at.is_multiple_of(2) {
                set(&graph, node, "where", [number, 2.0, 3.0])
            } else {
                set(&graph, node, "raw", [0.0, 0.0, number * 1000.0])
            };
            set.expect("a change");
            at += 1;
        }
    });
}

#[test]
fn what_means_nothing_is_refused_when_it_is_set() {
    let (graph, node) = graph();
    let refused = |name: &str, value: Value| {
        let refused = set(&graph, node, name, value).expect_err("a refusal");
        refused.to_string()
    };
    assert_eq!(
        refused("where", Value::from([1.0, 2.0])),
        "`where` of `Sighting` is dproto place, found 2 numbers, not 3 numbers"
    );
    let long = refused("turn", Value::from([0.0, 0.0, 0.0, 1.2]));
    assert!(long.contains("1.2 is not from 0.999 to 1.001"), "{long}");
    let zero = refused("turn", Value::from([0.0, 0.0, 0.0, 0.0]));
    assert!(zero.contains("0 is not from"), "{zero}");
    let mirror = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, -1.0];
    let mirrored = refused("matrix", Value::from(mirror));
    assert!(mirrored.contains("no value of `turn`"), "{mirrored}");
    let large = refused("where", Value::from([1e308, 0.0, 0.0]));
    assert!(large.contains("no value of `raw`"), "{large}");
    // Nothing has changed.
    assert_eq!(numbers(&graph, node, "where"), [1.0, 2.0, 3.0]);
    set(&graph, node, "turn", [0.0, 0.0, 1.0, 0.0]).expect("half a turn about z");
    let half = [-1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 1.0];
    assert_eq!(numbers(&graph, node, "matrix"), half);
}

#[test]
fn large_values_stay_on_a_topic() {
    let (graph, node) = graph();
    let sample = |kind: &str| Sample {
        topic: "camera.image".to_owned(),
        kind: kind.to_owned(),
        sequence: u64::MAX,
    };
    let picture = sample("RoboCompCamera::TImage");
    set(&graph, node, "picture", picture.clone()).expect("a change");
    let refused = set(&graph, node, "picture", sample("RoboCompLidar::Scan"));
    assert_eq!(
        refused.expect_err("another type").to_string(),
        "`picture` of `Sighting` is topic \"RoboCompCamera::TImage\", found topic \"RoboCompLidar::Scan\""
    );
    let refused = set(&graph, node, "thumb", vec![0_u8; 65537].as_slice());
    let refused = refused.expect_err("too many bytes").to_string();
    assert!(refused.contains("publish it on a topic"), "{refused}");
    // It comes back from a file, with all bits of its number.
    let now = graph.snapshot();
    let text = graph_json::write(&Document::of(&now));
    let mut sources = SourceMap::new();
    let source = sources.add("a.graph", text.as_str());
    let (read, found) = graph_json::read(&sources, source);
    assert!(
        found.is_empty(),
        "{}",
        render(&sources, &found, Format::Short)
    );
    let again = read.expect("a document").graph(Arc::clone(now.schema()), 2);
    let again = again.expect("a graph").snapshot();
    let node = again.nodes().next().expect("a node");
    assert_eq!(node.get("picture"), Some(&Value::from(picture)));
    assert_eq!(graph_json::write(&Document::of(&again)), text);
}

/// The findings of a file of one sighting with these attributes.
fn findings(attributes: &str) -> String {
    let schema = schema_of(DOMAIN, PROTOTYPES);
    let text = format!(
        "{{\"nodes\": [{{\"id\": \"1:1\", \"type\": \"Sighting\", \"attributes\": {{{attributes}}}}}]}}"
    );
    let mut sources = SourceMap::new();
    let source = sources.add("a.graph", text.as_str());
    let (read, mut found) = graph_json::read(&sources, source);
    if let Some(document) = read {
        found.extend(check(&document, &schema, &sources, source));
    }
    render(&sources, &found, Format::Short)
}

#[test]
fn wrong_blocks_of_a_file_are_findings() {
    assert_eq!(findings("\"raw\": [1.0, 2.0, 3.0]"), "");
    let unit = "\"where\": {\"value\": [1.0, 2.0, 3.0], \"unit\": \"m\"}";
    assert_eq!(findings(unit), "");
    let same = "\"where\": {\"value\": [1.0, 2.0, 3.0], \"unit\": \"metre\"}";
    assert_eq!(findings(same), "");
    let cases = [
        (
            "",
            "error[missing-value]: `Sighting` has no `where`, which is not optional",
        ),
        (
            "\"where\": {\"value\": [1.0, 2.0, 3.0], \"unit\": \"mm\"}",
            "error[unit-mismatch]: `where` is in `mm`, expected `m` (1 mm is 0.001 m)",
        ),
        (
            "\"where\": [1.0, 2.0, 3.0], \"raw\": [1.0, 2.0, 3.0]",
            "error[duplicate-member]: `raw` and `where` are one value, which is given twice",
        ),
        (
            "\"where\": [1.0, 2.0, 3.0, 4.0]",
            "error[wrong-value]: `where` of `Sighting` is dproto place, found 4 numbers, not 3 numbers",
        ),
        (
            "\"where\": [1.0, 2.0, 3.0], \"picture\": {\"topic\": \"a\", \"type\": \"b\", \"sequence\": -1}",
            "error[wrong-json]: expected a value of an attribute, found an object",
        ),
        (
            "\"where\": [1.0, 2.0, 3.0], \"picture\": {\"topic\": \"a\", \"type\": \"b\", \"sequence\": 1}",
            "error[wrong-value]: `picture` of `Sighting` is topic \"RoboCompCamera::TImage\", found topic \"b\"",
        ),
    ];
    for (attributes, expected) in cases {
        let found = findings(attributes);
        assert!(found.contains(expected), "{attributes}: {found}");
    }
    let bytes = "A".repeat(4 * (65538 / 3));
    let found = findings(&format!(
        "\"where\": [1.0, 2.0, 3.0], \"thumb\": {{\"bytes\": \"{bytes}\"}}"
    ));
    assert!(
        found.contains("`thumb` has 65538 bytes, expected 65536 at most"),
        "{found}"
    );
    assert!(found.contains("publish it on a topic"), "{found}");
}

/// The name of the prototype is the same, what it means is not: no number changes silently.
#[test]
fn a_prototype_that_means_something_else_is_no_silent_migration() {
    let (graph, _) = graph();
    let now = graph.snapshot();
    let same = migrate(&now, &schema_of(DOMAIN, PROTOTYPES), 2);
    assert!(
        same.differences.is_empty() && same.graph.is_some(),
        "{same:?}"
    );
    let turned = PROTOTYPES.replace("units = metres axes = body", "units = metres axes = camera");
    let migration = migrate(&now, &schema_of(DOMAIN, &turned), 2);
    assert!(migration.graph.is_none());
    let expected = "`where` of `Sighting` is Position (cartesian, m, ahead-left-up) in the graph, and \
                    Position (cartesian, m, right-down-ahead) in the new schema";
    assert_eq!(migration.findings, [expected]);
    let differ: Vec<&str> = migration
        .differences
        .iter()
        .map(|d| d.what.as_str())
        .collect();
    assert_eq!(differ, ["Sighting.where"]);
}

#[test]
fn queries_read_any_representation_also_of_a_file_with_faults() {
    let schema = schema_of(DOMAIN, PROTOTYPES);
    let block = schema.entity("Sighting").and_then(|e| e.attribute("raw"));
    assert!(matches!(block.map(|a| &a.kind), Some(Kind::Block(_))));
    let text = "{\"nodes\": [{\"id\": \"1:1\", \"type\": \"Sighting\", \"attributes\": {\"raw\": [0.0, 0.0, 5.0], \"what\": 1}}]}";
    let mut sources = SourceMap::new();
    let source = sources.add("a.graph", text);
    let (read, _) = graph_json::read(&sources, source);
    let kept = read.expect("a document").kept(&schema, 1).expect("a graph");
    let now = kept.snapshot();
    let node = now.nodes().next().expect("a node");
    assert_eq!(node.get("where"), Some(&Value::from([0.005, 0.0, 0.0])));
}

/// A type with a wrong value keeps all that the file says; the values of others convert.
#[test]
fn a_wrong_value_ends_the_conversions_of_its_type_alone() {
    let domain = DOMAIN.replace(
        "entity Sighting",
        "entity Other { where dproto place; raw dproto seen consistency where; };\n    entity Sighting",
    );
    let schema = schema_of(&domain, PROTOTYPES);
    for wrong in [
        r#""where": [1.0, 2.0, 3.0], "raw": [0.0, 0.0, 5.0]"#,
        r#""where": [1.0, 2.0]"#,
    ] {
        let text = format!(
            r#"{{"nodes": [{{"id": "1:1", "type": "Other", "attributes": {{"raw": [0.0, 0.0, 5.0]}}}},
                {{"id": "1:2", "type": "Sighting", "attributes": {{{wrong}}}}}]}}"#
        );
        let mut sources = SourceMap::new();
        let source = sources.add("a.graph", text);
        let document = graph_json::read(&sources, source).0.expect("a document");
        let unconverted: Vec<&str> = document.unconverted(&schema).into_iter().collect();
        assert_eq!(unconverted, ["Sighting"], "{wrong}");
        let now = document.kept(&schema, 1).expect("a graph").snapshot();
        let first = now.find(Id::new(1, 1)).and_then(|at| now.get(at, "where"));
        assert_eq!(
            first.cloned(),
            Some(Value::from([0.005, 0.0, 0.0])),
            "{wrong}"
        );
        let again = Document::of(&now);
        let said: Vec<usize> = again.nodes.iter().map(|n| n.attributes.len()).collect();
        assert_eq!(said, [1, document.nodes[1].attributes.len()], "{wrong}");
    }
}

/// The poses of a tree are numbers of a prototype: millimetres and a quaternion.
#[test]
fn transforms_take_poses_of_any_prototype() {
    let domain = r#"import "all.dproto";
Domain frames
{
    entity Frame { name string optional; };
    relation RT { parent Frame; child Frame; pose dproto stamped; tree interpolated; };
    relation seen { parent Frame; child Frame; pose dproto stamped; };
};
"#;
    let schema = schema_of(domain, PROTOTYPES);
    let graph = Graph::new(Arc::clone(&schema), 1);
    let half = std::f64::consts::FRAC_1_SQRT_2;
    // A quarter of a turn about z.
    let pose = [1000.0, 2000.0, 3000.0, 0.0, 0.0, half, half];
    let place = |graph: &Graph, relation: &str| {
        let made = graph.change(Time::ZERO, |edit| {
            let (base, arm) = (edit.add_node("Frame")?, edit.add_node("Frame")?);
            let edge = edit.add_edge(relation, base, arm)?;
            edit.set(edge, "pose", pose)?;
            Ok::<_, Error>((base, arm))
        });
        let (base, arm) = made.expect("two frames");
        graph.snapshot().pose(base, arm).expect("a pose")
    };
    for relation in ["RT", "seen"] {
        let found = place(&graph, relation);
        assert_eq!(found.translation, [1.0, 2.0, 3.0], "{relation}");
        let turn = found.rotation[2] - std::f64::consts::FRAC_PI_2;
        assert!(turn.abs() < 1e-12, "{relation}: {found:?}");
    }
    let (now, refused) = (graph.snapshot(), [0.0; 7]);
    let edge = now.edges().next().expect("an edge").edge_id();
    let refused = graph.change(Time::ZERO, |edit| edit.set(edge, "pose", refused));
    assert!(matches!(refused, Err(Error::Value { .. })), "{refused:?}");
    // A reader of a file of it without checks has the same poses.
    let kept = Document::of(&now).kept(&schema, 2).expect("a graph");
    let again = kept.snapshot();
    let ends = |of: &property_graph::Snapshot| {
        let edge = of.edges().next().expect("an edge");
        of.pose(edge.from(), edge.to()).expect("a pose")
    };
    assert_eq!(ends(&again), ends(&now));
}

#[test]
fn a_graph_adopts_one_of_several_attributes_that_are_one_value() {
    let (own, node) = graph();
    let id = own.snapshot().node(node).expect("a node").id();
    let other = Graph::new(Schema::anything().into(), 2);
    let made = other.change(Time::ZERO, |edit| {
        let node = edit.add_node_as(id, "Sighting")?;
        edit.set(node, "raw", [500.0, 0.0, 4000.0])?;
        Ok::<_, Error>(node)
    });
    let there = made.expect("a node");
    own.adopt(Time::ZERO, &other.snapshot()).expect("a change");
    assert_eq!(numbers(&own, node, "where"), [4.0, -0.5, 0.0]);
    let before = own.snapshot();
    own.adopt(Time::ZERO, &other.snapshot()).expect("no change");
    // Which of two values is right, nobody knows.
    set(&other, there, "where", [1.0, 2.0, 3.0]).expect("a change");
    let refused = own.adopt(Time::ZERO, &other.snapshot());
    let refused = refused.expect_err("two values").to_string();
    assert_eq!(
        refused,
        "`raw` and `where` of `Sighting` are one value, which is given twice"
    );
    assert!(Arc::ptr_eq(&before, &own.snapshot()));
}
