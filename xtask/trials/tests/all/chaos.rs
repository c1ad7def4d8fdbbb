//! Short runs of `cargo xtask chaos` with real components and real kills. A fixed seed chooses the
//! kills; the machine decides at which moments they fall.

use std::process::Command;
use std::sync::{Mutex, PoisonError};

/// The output of a successful run. One run at a time, because each of them measures.
fn chaos(words: &[&str]) -> String {
    static ALONE: Mutex<()> = Mutex::new(());
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let run = Command::new(env!("CARGO_BIN_EXE_trials"))
        .arg("chaos")
        .args(words)
        .output()
        .expect("to run trials");
    let output = String::from_utf8_lossy(&run.stdout).into_owned();
    let errors = String::from_utf8_lossy(&run.stderr);
    assert_eq!(run.status.code(), Some(0), "{output}{errors}");
    output
}

#[test]
fn twenty_kills_leave_nothing() {
    let output = chaos(&["--kills", "20", "--seed", "2"]);
    assert!(output.contains("by hand: 10 kills"), "{output}");
    assert!(output.contains("under rcdeploy: 10 kills"), "{output}");
}

#[test]
fn kills_under_load_leave_nothing() {
    let output = chaos(&["--seconds", "36", "--seed", "3"]);
    let kills = output
        .lines()
        .find(|line| line.contains(" components were killed"));
    let kills = kills.and_then(|line| line.split(' ').next());
    let kills: u32 = kills.expect("a number").parse().expect("a number");
    // One a second, but for those in which rcdeploy starts.
    assert!(kills > 12, "{output}");
    let skipped = output.lines().find(|line| line.starts_with("skipped: "));
    if let (Some(line), Some(list)) = (skipped, std::env::var_os("RC_TEST_SKIPPED")) {
        let mut options = std::fs::File::options();
        let list = options.append(true).create(true).open(list);
        let mut list = list.expect("the list of skipped tests");
        std::io::Write::write_all(&mut list, format!("{line}\n").as_bytes()).expect("written");
    }
}
