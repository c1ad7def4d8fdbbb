//! One chart for each test of the W3C's implementation report that asks something of a processor
//! without scripting, data, and input and output. The charts are our own; each begins with the
//! number and the assertion of the test. A chart passes if it ends in the state `pass`, and if its
//! functions ran in the order that its comment expects.

use crate::loading::{Run, model};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// All tests of <https://www.w3.org/Voice/2013/scxml-irp/>; the three parts of test 403 are three.
const TESTS: usize = 233;

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/machine/w3c")
}

fn charts() -> Vec<(String, String)> {
    let entries = std::fs::read_dir(folder()).expect("it is there");
    let paths = entries.map(|entry| entry.expect("it is there").path());
    let mut charts: Vec<(String, String)> = paths
        .filter(|path| path.extension().is_some_and(|e| e == "scxml"))
        .map(|path| {
            let number = path
                .file_stem()
                .expect("it is there")
                .to_string_lossy()
                .into_owned();
            (number, std::fs::read_to_string(path).expect("it is there"))
        })
        .collect();
    charts.sort();
    charts
}

/// Runs a chart. Returns its end state and the functions that it called.
fn run(number: &str, text: &str) -> (String, Vec<String>) {
    let mut run = Run::new(&model(&format!("{number}.scxml"), text), |name, _| {
        name == "yes"
    });
    run.start().unwrap_or_else(|e| panic!("{number}: {e}"));
    for _ in 0..1000 {
        if run.host.session.has_ended() {
            break;
        }
        let step = run.step().unwrap_or_else(|e| panic!("{number}: {e}"));
        assert!(step.is_some(), "{number}: stands in {:?}", run.active());
    }
    let end = run.host.session.end_state().expect("it ended");
    let chart = run.host.session.chart();
    (chart.state(end).name.to_string(), run.host.trace)
}

#[test]
fn all_charts_pass() {
    for (number, text) in charts() {
        assert!(
            text.starts_with(&format!("<!-- W3C test {number}: ")),
            "{number}"
        );
        let (end, trace) = run(&number, &text);
        assert_eq!(end, "pass", "{number}: {trace:?}");
        let comment = text.split("-->").next().expect("it is there");
        if let Some((_, expected)) = comment.split_once("\nexpected:") {
            let expected = expected
                .split('|')
                .map(str::trim)
                .filter(|line| !line.is_empty());
            assert_eq!(trace, expected.collect::<Vec<_>>(), "{number}");
        }
    }
}

#[test]
fn every_test_has_a_chart_or_a_reason() {
    let mut numbers: BTreeSet<String> = charts().into_iter().map(|(number, _)| number).collect();
    let left_out = std::fs::read_to_string(folder().join("left_out.txt")).expect("it is there");
    for line in left_out.lines().skip(1).filter(|line| !line.is_empty()) {
        let (tests, reason) = line.split_once(": ").expect("numbers and a reason");
        assert!(!reason.is_empty());
        for test in tests.split(' ') {
            assert!(numbers.insert(test.to_owned()), "{test} is listed twice");
        }
    }
    assert_eq!(numbers.len(), TESTS);
}
