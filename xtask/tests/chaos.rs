//! A short run of `cargo xtask chaos`, with real components and real kills: the same ones each time, as far as the
//! machine lets them fall into the same moments.

use std::process::Command;

#[test]
fn twenty_kills_leave_nothing() {
    let run = Command::new(env!("CARGO_BIN_EXE_xtask"))
        .args(["chaos", "--kills", "20", "--seed", "2"])
        .output()
        .expect("to run xtask");
    let said = String::from_utf8_lossy(&run.stdout);
    let errors = String::from_utf8_lossy(&run.stderr);
    assert_eq!(run.status.code(), Some(0), "{said}{errors}");
    assert!(said.contains("by hand: 10 kills"), "{said}");
    assert!(said.contains("under rcdeploy: 10 kills"), "{said}");
}
