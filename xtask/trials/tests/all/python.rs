//! A short run of `cargo xtask bench python`: components in Python and programs by hand exchange
//! messages, and each row is measured.

use crate::quiet;
use std::process::Command;

#[test]
fn components_in_python_are_measured_beside_programs_by_hand() {
    let _quiet = quiet();
    let run = Command::new(env!("CARGO_BIN_EXE_trials"))
        .args(["bench", "python", "--smoke"])
        .output()
        .expect("to run trials");
    let output = String::from_utf8_lossy(&run.stdout);
    let errors = String::from_utf8_lossy(&run.stderr);
    assert_eq!(run.status.code(), Some(0), "{output}{errors}");
    // The program itself lists what it skips.
    let skips = |what: &str| {
        let mut lines = errors.lines();
        lines
            .any(|line| line.starts_with(&format!("skipped: components in Python beside {what}: ")))
    };
    if skips("programs by hand") {
        return;
    }
    let mut peers = vec!["PyPI iceoryx2", "PyPI cyclonedds"];
    if !skips("rclpy") {
        peers.push("rclpy on Fast DDS");
    }
    for peer in &peers {
        assert!(output.contains(&format!("| {peer} p50 |")), "{output}");
    }
    for row in ["| publish 64 B, one way |", "| query 64 B, round trip |"] {
        // Times, and processor times.
        assert_eq!(output.matches(row).count(), 2 * peers.len(), "{output}");
    }
    assert!(output.contains("\nStart, p50 of 2: component "), "{output}");
}
