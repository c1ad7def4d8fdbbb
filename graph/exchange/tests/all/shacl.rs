//! The shapes of a schema, as pyshacl understands them, refuse what the check of files refuses.

use crate::blocks::{PROTOTYPES, schema_of};
use crate::faults::{CUP, KITCHEN, ROOM, cases, edge, ours};
use graph_exchange::{Document, check, dsr, graph_json, shapes, turtle};
use graph_schema::Schema;
use rc_diagnostics::{Diagnostics, SourceMap};
use std::process::Command;

const PACKAGES: &str = "pyshacl==0.40.1\n";

fn schema(text: &str) -> Schema {
    let mut sources = SourceMap::new();
    let source = sources.add("a.gdsl", text);
    let loader = rc_syntax::MemoryLoader::default();
    let (schema, found) = graph_language::load(&mut sources, &loader, source);
    assert!(!found.has_errors());
    schema.expect("a schema")
}

/// A graph as RDF with its shapes, and what the check says. None if the file itself has a fault, of which
/// its graph knows nothing.
fn judged(schema: &Schema, text: &str) -> Option<([String; 2], Diagnostics, SourceMap)> {
    let mut sources = SourceMap::new();
    let (source, mark) = graph_exchange::add(&mut sources, "a", text.to_owned());
    let (document, read) = if dsr::is_dsr(text) {
        dsr::read(&sources, source)
    } else {
        graph_json::read(&sources, source)
    };
    let document: Document = document.filter(|_| mark.is_none() && !read.has_errors())?;
    let found = check(&document, schema, &sources, source);
    let rdf = [turtle::write(&document, schema), shapes::write(schema)];
    Some((rdf, found, sources))
}

/// The focus nodes of the violations of each graph. None without pyshacl.
fn violations(graphs: &[[String; 2]], test: &str) -> Option<Vec<Vec<String>>> {
    let python = rc_test_support::python::packages("pyshacl", PACKAGES, test)?;
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("graphs.json");
    let graphs = serde_json::to_string(graphs).expect("a text");
    std::fs::write(&file, graphs).expect("a file");
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/all/shacl.py");
    let output = Command::new(python).arg(script).arg(&file).output();
    let output = output.expect("python");
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{errors}");
    Some(serde_json::from_slice(&output.stdout).expect("lists"))
}

/// The resource of an id as a file has it.
fn resource(id: &str) -> String {
    format!("urn:robocomp:element:{id}")
}

/// What follows a member's name in a line of a file.
fn member(line: &str, name: &str) -> Option<String> {
    let (_, rest) = line.split_once(&format!("\"{name}\": \""))?;
    Some(rest.split_once('"')?.0.to_owned())
}

#[test]
fn pyshacl_refuses_the_graphs_with_one_fault() {
    let schema = schema(KITCHEN);
    let mut graphs = Vec::new();
    let mut faults = Vec::new();
    for (text, code, _) in cases() {
        let Some((rdf, found, sources)) = judged(&schema, &text) else {
            continue;
        };
        let finding = found.into_iter().next().expect("a finding");
        let before = &sources.text(finding.span.source)[..finding.span.start];
        let line = text.lines().nth(before.matches('\n').count());
        let line = line.expect("its line").to_owned();
        graphs.push(rdf);
        faults.push((code, line, text));
    }
    assert!(faults.len() >= 30, "only {} graphs", faults.len());
    let test = "pyshacl_refuses_the_graphs_with_one_fault";
    let Some(violations) = violations(&graphs, test) else {
        return;
    };
    for ((code, line, text), focus) in faults.iter().zip(&violations) {
        // A shape may be about an end of the edge that has the fault.
        let places = ["id", "from", "to"].map(|name| member(line, name));
        let mut places = places.iter().flatten().map(|id| resource(id));
        let is_there = places.any(|place| focus.contains(&place));
        assert!(is_there, "{code} at {line}: {focus:?} in\n{text}");
    }
    println!("{} graphs with one fault", faults.len());
}

/// A random graph of the kitchen, of which about half have faults.
fn random_graph(random: &mut fastrand::Rng) -> String {
    const KINDS: [&str; 5] = ["Cup", "Object", "Room", "Gripper", "Event"];
    let is_odd = |random: &mut fastrand::Rng| random.u32(0..60) == 0;
    let count = random.u32(3..8);
    let mut kinds: Vec<&str> = Vec::new();
    let mut nodes = Vec::new();
    for at in 1..=count {
        let kind = KINDS[random.usize(0..5)];
        let mut attributes = Vec::new();
        match kind {
            "Gripper" => attributes.push(format!("\"payload\": {}", random.u32(1..4))),
            "Event" => {}
            _ => {
                let name = if is_odd(random) { 0 } else { at };
                attributes.push(format!("\"name\": \"n{name}\""));
                if kind != "Room" && random.bool() {
                    let mass = if is_odd(random) {
                        200
                    } else {
                        random.i32(0..4)
                    };
                    attributes.push(format!("\"mass\": {mass}.5"));
                }
                if kind != "Room" && random.bool() {
                    let numbers = if is_odd(random) {
                        "1.0, 1.0"
                    } else {
                        "1.0, 1, 1.0"
                    };
                    attributes.push(format!("\"size\": [{numbers}]"));
                }
            }
        }
        if is_odd(random) {
            attributes.push("\"weight\": 1".to_owned());
        }
        let attributes = attributes.join(", ");
        nodes.push(format!(
            r#"{{"id": "1:{at}", "type": "{kind}", "attributes": {{{attributes}}}}}"#
        ));
        kinds.push(kind);
    }
    let mut edges: Vec<String> = Vec::new();
    // The rules of a relation at its ports, and edges that are events.
    let mut events: Vec<u32> = Vec::new();
    for at in 0..random.u32(0..8) {
        let (kind, from, to): (_, &[&str], &[&str]) = match random.u32(0..5) {
            0 => ("in", &["Cup", "Object"], &["Room"]),
            1 => ("near", &["Cup", "Object"], &["Cup", "Object"]),
            2 => ("grasp", &["Gripper"], &["Cup", "Object"]),
            3 => ("move", &["Cup", "Object"], &["Room"]),
            _ => ("causes", &["Event"], &["Event"]),
        };
        let mut pick = |wanted: &[&str]| {
            let is_free = is_odd(random);
            let fits = |at: &u32| is_free || wanted.contains(&kinds[*at as usize - 1]);
            let mut all: Vec<u32> = (1..=count).filter(fits).collect();
            if wanted == ["Event"] {
                all.extend(&events);
            }
            (!all.is_empty()).then(|| all[random.usize(0..all.len())])
        };
        let (Some(from), Some(to)) = (pick(from), pick(to)) else {
            continue;
        };
        let id = 100 + at;
        edges.push(edge(id, kind, from, to));
        if matches!(kind, "move" | "causes") {
            events.push(id);
        }
    }
    ours(&nodes.join(",\n"), &edges.join(",\n"))
}

/// What a relation has of the entity that it promotes, and rules about it.
const MEASURING: &str = r#"Domain measuring
{
    entity Gripper { delay float unit "s"; };
    entity Measurement { time float unit "s"; };
    relation grasp { by Gripper; other Gripper; force float optional; promotes Measurement; };
    relation said { what Measurement; by Gripper; };
    require what.time <= by.delay of said "too late";
};
"#;

/// A type that inherits has another representation of a value.
const SEEING: &str = r#"import "all.dproto";
Domain seeing
{
    entity Thing { where dproto place; };
    entity Sighting : Thing { raw dproto seen consistency where; };
};
"#;

/// Two grippers, and edges: the second one is at the first one.
fn measured(grasp: &str) -> String {
    let gripper =
        |id| format!(r#"{{"id": "1:{id}", "type": "Gripper", "attributes": {{"delay": 2.5}}}}"#);
    let grasp = format!(
        r#"{{"id": "1:3", "type": "grasp", "from": "1:1", "to": "1:2", "attributes": {{{grasp}}}}}"#
    );
    let edges = format!("{grasp},\n{}", edge(4, "said", 3, 1));
    ours(&format!("{},\n{}", gripper(1), gripper(2)), &edges)
}

fn sighting(attributes: &str) -> String {
    let node = format!(r#"{{"id": "1:1", "type": "Sighting", "attributes": {{{attributes}}}}}"#);
    ours(&node, "")
}

#[test]
fn pyshacl_judges_as_the_check_does() {
    let (kitchen, open) = (schema(KITCHEN), KITCHEN.replace("kitchen", "kitchen open"));
    let open = schema(&open);
    let dsr_schema = graph_language::builtin("dsr.gdsl").expect("a schema");
    let two = format!("{CUP},\n{ROOM}");
    let events = [
        edge(9, "causes", 7, 8),
        edge(7, "move", 1, 2),
        edge(8, "move", 1, 2),
    ];
    let unknown = format!(
        "{CUP},\n{}",
        r#"{"id": "1:2", "type": "Yard", "attributes": {"colour": {"ints": []}}}"#
    );
    let dsr = r#"{"DSRModel": {"symbols": {
"1": {"id": "1", "name": "root", "type": "root", "attribute": {"level": {"type": 1, "value": 0}}, "links": [
{"src": "1", "dst": "2", "label": "RT", "linkAttribute": {
"rt_translation": {"type": 3, "value": [1.5, 0, 0]},
"rt_rotation_euler_xyz": {"type": 3, "value": [0, 0, 0]}}}]},
"2": {"id": "2", "name": "wheel \u00e9\"\n", "type": "wheel of mine", "attribute": {}, "links": []}}}}"#;
    let (measuring, seeing) = (schema(MEASURING), schema_of(SEEING, PROTOTYPES));
    let right = [
        (&measuring, measured(r#""time": 2.0"#)),
        (&measuring, measured(r#""time": 2, "force": 3.0"#)),
        (&*seeing, sighting(r#""raw": [1.0, 2.0, 3.0]"#)),
        (&seeing, sighting(r#""where": [1.0, 2.0, 3.0]"#)),
        (&kitchen, ours(&two, &edge(9, "in", 1, 2))),
        (&kitchen, ours(&two, &events.join(",\n"))),
        (&open, ours(&unknown, &edge(9, "in", 1, 2))),
        (&dsr_schema, dsr.to_owned()),
    ];
    let wrong = [
        (&measuring, measured("")),
        (&measuring, measured(r#""time": 3.0"#)),
        (&*seeing, sighting("")),
        (
            &seeing,
            sighting(r#""where": [1.0, 2.0, 3.0], "raw": [1.0, 2.0, 3.0]"#),
        ),
        (&open, ours(&two, &edge(9, "in", 1, 5))),
        (&open, ours(&two, &edge(9, "in", 2, 1))),
        (&dsr_schema, dsr.replace("1.5", "1500")),
    ];
    let (sound, known) = (right.len(), right.len() + wrong.len());
    let mut random = fastrand::Rng::with_seed(40);
    let random = (0..60).map(|_| (&kitchen, random_graph(&mut random)));
    let all = right.into_iter().chain(wrong).chain(random);
    let (mut graphs, mut verdicts) = (Vec::new(), Vec::new());
    for (schema, text) in all {
        let (rdf, found, _) = judged(schema, &text).expect("a graph");
        graphs.push(rdf);
        verdicts.push((found.has_errors(), text));
    }
    let faulty: Vec<bool> = verdicts.iter().map(|(faulty, _)| *faulty).collect();
    assert_eq!(faulty[..sound], vec![false; sound]);
    assert_eq!(faulty[sound..known], vec![true; known - sound]);
    let faulty = &faulty[known..];
    let count = faulty.iter().filter(|faulty| **faulty).count();
    assert!((15..50).contains(&count), "{count} of {}", faulty.len());
    let Some(violations) = violations(&graphs, "pyshacl_judges_as_the_check_does") else {
        return;
    };
    for (((faulty, text), focus), rdf) in verdicts.iter().zip(&violations).zip(&graphs) {
        assert_eq!(
            *faulty,
            !focus.is_empty(),
            "{focus:?} for\n{text}\n{}",
            rdf[0]
        );
    }
}
