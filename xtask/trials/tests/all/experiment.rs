//! A short run of `cargo xtask experiment`: each task works, with the lines that BENCHMARKS.md
//! lists.

use crate::alone;
use std::process::Command;

#[test]
fn each_task_of_the_paper_works_with_the_documented_lines() {
    let _alone = alone();
    let run = Command::new(env!("CARGO_BIN_EXE_trials"))
        .args(["experiment", "--smoke"])
        .output()
        .expect("to run trials");
    let said = String::from_utf8_lossy(&run.stdout);
    let errors = String::from_utf8_lossy(&run.stderr);
    assert_eq!(run.status.code(), Some(0), "{said}{errors}");
    let documented = include_str!("../../../../BENCHMARKS.md");
    let mut rows = 0;
    for line in said.lines().skip(2) {
        // All but the time.
        let row = line.trim_end_matches('|').trim_end();
        let (row, _) = row.rsplit_once('|').expect("a row");
        assert!(
            documented.contains(row),
            "BENCHMARKS.md has no row `{row}`:\n{said}"
        );
        rows += 1;
    }
    assert_eq!(rows, 7, "{said}");
}

#[test]
fn the_tasks_are_counted_over_components_of_this_repository() {
    let _alone = alone();
    let run = Command::new(env!("CARGO_BIN_EXE_trials"))
        .args(["experiment", "components", "--smoke"])
        .output()
        .expect("to run trials");
    let said = String::from_utf8_lossy(&run.stdout);
    let errors = String::from_utf8_lossy(&run.stderr);
    assert_eq!(run.status.code(), Some(0), "{said}{errors}");
    let rows: Vec<&str> = said.lines().skip(2).collect();
    assert_eq!(rows.len(), 10, "{said}");
    // A new method is typed in fewer lines with the tools than by hand.
    let numbers = |row: &str| -> Vec<f64> {
        let cells = row.split('|').skip(3);
        let first = cells.filter_map(|cell| cell.split_whitespace().next()?.parse().ok());
        first.collect()
    };
    let method = numbers(rows[2]);
    assert!(method[0] < method[1], "{said}");
}
