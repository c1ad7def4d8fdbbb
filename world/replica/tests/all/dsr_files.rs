//! Three replicas change what real files of DSR have, in turns, and end with what a script in Python has that makes the
//! same changes one after the other.

use fastrand::Rng;
use graph_exchange::{Document, Id, dsr};
use property_graph::{EdgeId, Edit, Error, NodeId, Schema, Snapshot};
use rc_diagnostics::SourceMap;
use rc_world::{Setup, World};
use serde_json::{Value, json};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Arc;
use std::time::Duration;

/// How many changes each file gets. `RC_WORLD_SCRIPT` sets another number.
const STEPS: usize = 300;

/// Like each other, and with more to change than files have.
const NODES: &str = r#"{"DSRModel": {"symbols": {
    "1": {"attribute": {}, "id": "1", "name": "world", "type": "root", "links": [
        {"dst": "2", "label": "RT", "src": "1", "linkAttribute": {
            "rt_translation": {"type": 3, "value": [1, 2, 3]},
            "rt_rotation_euler_xyz": {"type": 3, "value": [0, 0, 0.5]}}}]},
    "2": {"attribute": {"level": {"type": 1, "value": 1}}, "id": "2", "name": "robot", "type": "robot", "links": []}}}}"#;

fn real() -> Vec<PathBuf> {
    let Some(folder) = std::env::var_os("RC_REAL_FILES") else {
        println!("skipped: real files of DSR: RC_REAL_FILES names no folder");
        return Vec::new();
    };
    let entries = std::fs::read_dir(PathBuf::from(folder).join("dsr"));
    let paths = entries.expect("the folder `dsr`").flatten();
    let mut paths: Vec<PathBuf> = paths.map(|entry| entry.path()).collect();
    paths.sort();
    paths
}

fn node(now: &Snapshot, name: &Value) -> NodeId {
    let name = name.as_str().expect("a name");
    now.named(name).next().expect("a node of the script")
}

fn edge(now: &Snapshot, step: &[Value]) -> EdgeId {
    let (from, to) = (node(now, &step[1]), node(now, &step[3]));
    let label = now.symbol(step[2].as_str().expect("a label"));
    let mut edges = now.out_edges(from, label);
    let edge = edges.find(|edge| edge.to() == to);
    edge.expect("an edge of the script").edge_id()
}

fn value(of: &Value) -> property_graph::Value {
    match of {
        Value::Bool(yes) => (*yes).into(),
        Value::Number(number) => match number.as_i64() {
            Some(number) => number.into(),
            None => number.as_f64().expect("a number").into(),
        },
        Value::String(text) => text.as_str().into(),
        Value::Array(all) => {
            let all: Vec<f64> = all.iter().filter_map(Value::as_f64).collect();
            all.as_slice().into()
        }
        other => panic!("no value: {other}"),
    }
}

/// Makes a change of the script.
fn make(edit: &mut Edit, step: &[Value]) -> Result<(), Error> {
    let text = |at: usize| step[at].as_str().expect("a text");
    let now = edit.snapshot().clone();
    match text(0) {
        "add" => {
            let new = edit.add_node(text(2))?;
            edit.set(new, "name", text(1))
        }
        "set" => edit.set(node(&now, &step[1]), text(2), value(&step[3])),
        "unset" => edit.unset(node(&now, &step[1]), text(2)),
        "remove" => edit.remove_node(node(&now, &step[1])),
        "link" => {
            let (from, to) = (node(&now, &step[1]), node(&now, &step[3]));
            edit.add_edge(text(2), from, to).map(|_| ())
        }
        "unlink" => edit.remove_edge(edge(&now, step)),
        _ => edit.set(edge(&now, step), text(4), value(&step[5])),
    }
}

/// A change that fits what there is.
fn draw(now: &Snapshot, random: &mut Rng, at: usize) -> Vec<Value> {
    let names: Vec<&str> = now.nodes().map(|node| node.name()).collect();
    let pick = |random: &mut Rng| names[random.usize(..names.len())].to_owned();
    let edges: Vec<[String; 3]> = now
        .edges()
        .map(|edge| {
            let name = |node| now.node(node).expect("a node").name().to_owned();
            [
                name(edge.from()),
                edge.type_name().to_owned(),
                name(edge.to()),
            ]
        })
        .collect();
    let number = f64::from(random.i32(-4000..4000)) / 64.0;
    let some = match random.u8(..5) {
        0 => json!(random.i32(-1000..1000)),
        1 => json!(format!("text {at}")),
        2 => json!([number, 0.25, at as f64]),
        3 => json!(random.bool()),
        _ => json!(number + 0.125),
    };
    let attribute = format!("x{}", random.u8(..4));
    let step = match random.u8(..20) {
        0..3 => json!(["add", format!("new {at}"), "object"]),
        3 if names.len() > 4 => json!(["remove", pick(random)]),
        4..7 => {
            let (from, to) = (pick(random), pick(random));
            let label = ["has", "in", "near"][random.usize(..3)];
            let is_there = edges
                .iter()
                .any(|[a, l, b]| *a == from && l == label && *b == to);
            if is_there || from == to {
                json!(["set", from, attribute, some])
            } else {
                json!(["link", from, label, to])
            }
        }
        7 if !edges.is_empty() => {
            let [from, label, to] = &edges[random.usize(..edges.len())];
            json!(["unlink", from, label, to])
        }
        8..11 if !edges.is_empty() => {
            let [from, label, to] = &edges[random.usize(..edges.len())];
            if label == "RT" {
                let place = json!([number, 1.5, -2.25]);
                json!(["assign", from, label, to, "rt_translation", place])
            } else {
                json!(["assign", from, label, to, attribute, some])
            }
        }
        11..13 => json!(["unset", pick(random), attribute]),
        _ => json!(["set", pick(random), attribute, some]),
    };
    step.as_array().expect("a step").clone()
}

/// Takes each message to all other replicas.
fn deliver(worlds: &[World]) {
    for (at, world) in worlds.iter().enumerate() {
        world.turn(Duration::ZERO);
        while let Some(message) = world.take() {
            let others = worlds.iter().enumerate().filter(|(other, _)| *other != at);
            for (_, other) in others {
                other.receive(Duration::ZERO, crate::network::through_bytes(&message));
            }
        }
    }
}

/// What a replica has, as a file of DSR, whose ids have 64 bits.
fn print(world: &World, path: &Path) {
    let mut document = Document::of(&world.snapshot());
    let mut ids: HashMap<Id, Id> = HashMap::new();
    for (at, node) in document.nodes.iter_mut().enumerate() {
        let id = Id(1_000_000 + at as u128);
        ids.insert(node.id, id);
        node.id = id;
    }
    for edge in &mut document.edges {
        (edge.from, edge.to) = (ids[&edge.from], ids[&edge.to]);
    }
    let (text, lost) = dsr::write(&document);
    assert!(lost.is_empty(), "{lost:?}");
    std::fs::write(path, text).expect("a file");
}

#[test]
fn replicas_have_what_a_script_makes_of_files_of_dsr() {
    let test = "replicas_have_what_a_script_makes_of_files_of_dsr";
    let folder = tempfile::tempdir().expect("a folder");
    let own = folder.path().join("own.json");
    std::fs::write(&own, NODES).expect("a file");
    let paths = [vec![own], real()].concat();
    let number = std::env::var("RC_WORLD_SCRIPT").ok();
    let steps = number
        .and_then(|number| number.parse().ok())
        .unwrap_or(STEPS);
    let schema = Arc::new(graph_language::builtin("dsr.gdsl").expect("a schema"));
    let mut cases = Vec::new();
    for (number, path) in paths.iter().enumerate() {
        let mut sources = SourceMap::new();
        let text = std::fs::read_to_string(path).expect("a text");
        let source = sources.add(path, text);
        let (document, found) = dsr::read(&sources, source);
        let Some(document) = document else {
            let told = rc_diagnostics::render(&sources, &found, rc_diagnostics::Format::Short);
            println!("{told}");
            continue;
        };
        // A few files have less than the schema wants.
        let strict = document.graph(Arc::clone(&schema), 1);
        let (schema, start) = match strict {
            Ok(graph) => (Arc::clone(&schema), graph),
            Err(error) => {
                println!("without a schema, for {error}: {}", path.display());
                let any = Arc::new(Schema::anything());
                let graph = document.graph(Arc::clone(&any), 1).expect("a graph");
                (any, graph)
            }
        };
        let worlds: Vec<World> = (0..3)
            .map(|at| {
                let setup = Setup::new(&format!("agent{at}"), Arc::clone(&schema));
                World::new(setup.with_writer(100 + at))
            })
            .collect();
        worlds[0].start_with(&start.snapshot()).expect("a start");
        for world in &worlds[1..] {
            worlds[0].meet(world).expect("one schema");
        }
        let mut random = Rng::with_seed(number as u64);
        let mut script = Vec::new();
        for at in 0..steps {
            let world = &worlds[at % worlds.len()];
            let step = draw(&world.snapshot(), &mut random, at);
            let made = world.change(|edit| Ok(make(edit, &step)?));
            made.unwrap_or_else(|error| panic!("{}: {step:?}: {error}", path.display()));
            deliver(&worlds);
            script.push(step);
        }
        let printed = worlds.iter().enumerate().map(|(at, world)| {
            let file = folder.path().join(format!("{number}-{at}.json"));
            print(world, &file);
            file
        });
        cases.push(json!([path, script, printed.collect::<Vec<_>>()]));
    }
    if paths.len() > 1 {
        assert!(cases.len() > 5, "{} files", cases.len());
    }
    let Some(python) = rc_test_support::python::interpreter("scipy==1.17.1", test) else {
        return;
    };
    let file = folder.path().join("cases.json");
    std::fs::write(&file, Value::from(cases).to_string()).expect("a file");
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/all/dsr_files.py");
    let output = Command::new(python).arg(script).arg(&file).output();
    let output = output.expect("python");
    let told = String::from_utf8_lossy(&output.stdout);
    assert!(
        output.status.success(),
        "{told}{}",
        String::from_utf8_lossy(&output.stderr)
    );
    print!("{told}");
}
