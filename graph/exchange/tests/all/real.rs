//! Real files of DSR: read, printed and read again they are equal.

use graph_exchange::{Document, dsr};
use property_graph::{Snapshot, Value};
use rc_diagnostics::{Format, SourceMap, render};
use std::collections::HashMap;
use std::path::PathBuf;
use std::process::Command;

/// The files in the folder `dsr` that `RC_REAL_FILES` names. None if it names none.
fn real() -> Vec<PathBuf> {
    let Some(folder) = std::env::var_os("RC_REAL_FILES") else {
        println!("skipped: real files of DSR: RC_REAL_FILES names no folder");
        return Vec::new();
    };
    let Ok(entries) = std::fs::read_dir(PathBuf::from(folder).join("dsr")) else {
        println!("skipped: real files of DSR: the folder has no `dsr`");
        return Vec::new();
    };
    let paths = entries.flatten().map(|entry| entry.path());
    let mut paths: Vec<PathBuf> = paths.collect();
    paths.sort();
    paths
}

#[test]
fn real_files_are_printed_and_read_equal() {
    let schema = graph_language::builtin("dsr.gdsl").expect("a schema");
    let mut equal = 0;
    for path in real() {
        let mut sources = SourceMap::new();
        let text = std::fs::read_to_string(&path).expect("a text");
        let source = sources.add(&path, text);
        let (document, found) = dsr::read(&sources, source);
        let told = render(&sources, &found, Format::Short);
        let Some(document) = document else {
            assert!(told.contains("error[malformed-json]"), "{told}");
            println!("refused: {told}");
            continue;
        };
        let is_known = |line: &str| line.contains("warning[older-name]");
        assert!(told.lines().all(is_known), "{}: {told}", path.display());
        let graph = document.kept(&schema, 1);
        let graph = graph.unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        let first = Document::of(&graph.snapshot());
        let (printed, lost) = dsr::write(&first);
        assert!(lost.is_empty(), "{}: {lost:?}", path.display());
        let source = sources.add("printed.json", printed);
        let (again, _) = dsr::read(&sources, source);
        let again = again.expect("a document").kept(&schema, 1);
        let again = Document::of(&again.expect("a graph").snapshot());
        assert_eq!(again, first, "{}", path.display());
        equal += 1;
    }
    println!("{equal} real files are equal");
}

/// The names of the attributes with a pose.
const POSE: [&str; 2] = ["rt_translation", "rt_rotation_euler_xyz"];

/// The edges of a tree with their numbers, and the transforms of all pairs of nodes that we have:
/// rotation by rows, then translation.
fn transforms(graph: &Snapshot) -> Option<serde_json::Value> {
    let numbers =
        |value: &Value| -> Vec<f64> { (0..3).filter_map(|at| value.number(at)).collect() };
    let count = |node| graph.node(node).expect("a node").id().count();
    let edges = graph
        .edges()
        .filter(|edge| edge.type_name() == "RT")
        .map(|edge| {
            let [place, turn] = POSE.map(|name| edge.get(name).map(numbers));
            Some((count(edge.from()), count(edge.to()), place?, turn?))
        });
    let edges = edges.collect::<Option<Vec<_>>>()?;
    let above: HashMap<u64, u64> = edges.iter().map(|edge| (edge.1, edge.0)).collect();
    let root = |mut node: u64| {
        while let Some(next) = above.get(&node) {
            node = *next;
        }
        node
    };
    let is_placed = |node: u64| edges.iter().any(|edge| edge.0 == node || edge.1 == node);
    let nodes: Vec<_> = graph
        .nodes()
        .map(|node| node.node_id())
        .filter(|node| is_placed(count(*node)))
        .collect();
    let mut pairs = Vec::new();
    for to in &nodes {
        for from in &nodes {
            if root(count(*to)) != root(count(*from)) {
                continue;
            }
            let [a, b] = [to, from].map(|node| graph.frame(*node).expect("a frame"));
            let between = graph
                .between(a, b)
                .expect("a transform of nodes with one root");
            let mut cells: Vec<f64> = (0..9)
                .map(|at| between.rotation[(at / 3, at % 3)])
                .collect();
            let t = between.translation;
            cells.extend([t.x, t.y, t.z]);
            pairs.push((count(*to), count(*from), cells));
        }
    }
    Some(serde_json::json!({ "edges": edges, "pairs": pairs }))
}

#[test]
fn transforms_of_real_files_are_those_of_scipy() {
    let paths = real();
    if paths.is_empty() {
        return;
    }
    let test = "transforms_of_real_files_are_those_of_scipy";
    let Some(python) = rc_test_support::python::interpreter("scipy==1.17.1", test) else {
        return;
    };
    let schema = graph_language::builtin("dsr.gdsl").expect("a schema");
    let mut all = Vec::new();
    for path in paths {
        let mut sources = SourceMap::new();
        let text = std::fs::read_to_string(&path).expect("a text");
        let source = sources.add(&path, text);
        let Some(document) = dsr::read(&sources, source).0 else {
            continue;
        };
        let graph = document.kept(&schema, 1).expect("a graph").snapshot();
        match transforms(&graph) {
            Some(transforms) => all.push(transforms),
            None => panic!("an edge has no pose: {}", path.display()),
        }
    }
    println!("{} files with poses", all.len());
    assert!(!all.is_empty());
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("transforms.json");
    std::fs::write(&file, serde_json::Value::from(all).to_string()).expect("a file");
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/all/real.py");
    let output = Command::new(python).arg(script).arg(&file).output();
    let output = output.expect("python");
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{errors}");
    println!("{}", String::from_utf8_lossy(&output.stdout));
}
