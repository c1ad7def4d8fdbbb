//! A short run of `cargo xtask bench fresh`.

use std::process::Command;

#[test]
fn kept_values_and_chains_are_measured() {
    let run = Command::new(env!("CARGO_BIN_EXE_trials"))
        .args(["bench", "fresh", "--smoke"])
        .output()
        .expect("to run trials");
    let output = String::from_utf8_lossy(&run.stdout);
    let errors = String::from_utf8_lossy(&run.stderr);
    assert_eq!(run.status.code(), Some(0), "{output}{errors}");
    let rows = output.lines().filter(|line| line.contains(" ≤ ")).count();
    assert_eq!(rows, 6, "{output}");
}
