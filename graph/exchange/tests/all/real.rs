//! Real files of DSR: read, printed and read again they are equal.

use graph_exchange::{Document, dsr};
use rc_diagnostics::{Format, SourceMap, render};
use std::path::PathBuf;

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
        assert_eq!(told, "", "{}", path.display());
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
