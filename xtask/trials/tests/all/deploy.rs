//! A short run of `cargo xtask bench deploy`: each starter starts, is measured, and ends, and half
//! of a network recovers from its death.

use crate::alone;
use std::process::Command;

#[test]
fn everybody_starts_and_ends_a_few_programs() {
    let _alone = alone();
    let run = Command::new(env!("CARGO_BIN_EXE_trials"))
        .args(["bench", "deploy", "--smoke"])
        .output()
        .expect("to run trials");
    let output = String::from_utf8_lossy(&run.stdout);
    let errors = String::from_utf8_lossy(&run.stderr);
    assert_eq!(run.status.code(), Some(0), "{output}{errors}");
    for row in ["| 5 | rcdeploy | ", "| 5 | sh | ", "| 20 of 40 | "] {
        assert!(output.contains(row), "{output}");
    }
    let skipped = output.lines().find(|line| line.starts_with("skipped: "));
    assert!(
        output.contains("| 5 | supervisord ") != skipped.is_some(),
        "{output}"
    );
    if let (Some(line), Some(list)) = (skipped, std::env::var_os("RC_TEST_SKIPPED")) {
        let list = std::fs::File::options()
            .append(true)
            .create(true)
            .open(list);
        std::io::Write::write_all(
            &mut list.expect("the list of skipped tests"),
            format!("{line}\n").as_bytes(),
        )
        .expect("written");
    }
}
