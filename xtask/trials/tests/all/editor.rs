//! A short session of `cargo xtask bench editor`.

use std::process::Command;

#[test]
fn a_session_of_an_editor_is_measured() {
    let run = Command::new(env!("CARGO_BIN_EXE_trials"))
        .args(["bench", "editor", "--smoke"])
        .output()
        .expect("to run trials");
    let output = String::from_utf8_lossy(&run.stdout);
    let errors = String::from_utf8_lossy(&run.stderr);
    assert_eq!(run.status.code(), Some(0), "{output}{errors}");
    // Two rows of each language, the time of the start, and the memory.
    let rows = output.lines().filter(|line| line.starts_with("| ")).count();
    assert_eq!(rows, 9, "{output}");
}
