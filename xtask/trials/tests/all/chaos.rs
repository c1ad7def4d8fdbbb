//! Short runs of `cargo xtask chaos` with real components and real kills. A fixed seed chooses the
//! kills; the machine decides at which moments they fall.

use crate::alone;
use std::process::Command;

/// The output of a successful run.
fn chaos(words: &[&str]) -> String {
    let _alone = alone();
    let run = Command::new(env!("CARGO_BIN_EXE_trials"))
        .arg("chaos")
        .args(words)
        .arg("--smoke")
        .output()
        .expect("to run trials");
    let output = String::from_utf8_lossy(&run.stdout).into_owned();
    let errors = String::from_utf8_lossy(&run.stderr);
    assert_eq!(run.status.code(), Some(0), "{output}{errors}");
    output
}

#[test]
fn twenty_four_kills_leave_nothing() {
    let output = chaos(&["--kills", "24", "--seed", "2"]);
    for part in ["by hand", "under rcdeploy", "as one process"] {
        assert!(output.contains(&format!("{part}: 8 kills")), "{output}");
    }
}

#[test]
fn kills_under_load_leave_nothing() {
    let output = chaos(&["--seconds", "24", "--seed", "3"]);
    let kills = output
        .lines()
        .find(|line| line.contains(" components were killed"));
    let kills = kills.and_then(|line| line.split(' ').next());
    let kills: u32 = kills.expect("a number").parse().expect("a number");
    // At least one a second.
    assert!(kills >= 24, "{output}");
    let skipped = output.lines().filter(|line| line.starts_with("skipped: "));
    for line in skipped {
        let Some(list) = std::env::var_os("RC_TEST_SKIPPED") else {
            continue;
        };
        let mut options = std::fs::File::options();
        let list = options.append(true).create(true).open(list);
        let mut list = list.expect("the list of skipped tests");
        std::io::Write::write_all(&mut list, format!("{line}\n").as_bytes()).expect("written");
    }
}
