//! A component whose values know their age lives again exactly: ages, what was collected, kept replies
//! and last values are the same. Inside its process nothing of this is encoded.

mod program;

use std::io::Write;
use std::path::Path;
use std::process::{Command, Output, Stdio};

/// The command line of the component, in the process that this test starts: one argument a line.
const ARGUMENTS: &str = "RC_TEST_AGED";
/// A message of MCAP: its code, and where its data begin, behind the encapsulation of CDR.
const MESSAGE: u8 = 5;
const DATA: usize = 2 + 4 + 8 + 8 + 4;

/// Runs the component in a process that this test has started for it. Then, there is no return.
fn run_in_its_process() {
    if let Ok(arguments) = std::env::var(ARGUMENTS) {
        let arguments: Vec<&str> = arguments.lines().collect();
        std::process::exit(program::main(&arguments).into());
    }
}

/// The component with further arguments, in a process of its own.
fn program(folder: &Path, more: &str) -> Command {
    let mut command = Command::new(std::env::current_exe().expect("this program"));
    command
        .args([
            "aged::values_with_ages_live_again_exactly",
            "--exact",
            "--nocapture",
        ])
        .env(ARGUMENTS, format!("--network\naged\n--name\naged\n{more}"))
        .env("XDG_RUNTIME_DIR", folder);
    command
}

/// The number before a word that the component has printed.
fn printed(ran: &Output, word: &str) -> u32 {
    let words = String::from_utf8_lossy(&ran.stdout);
    assert!(ran.status.success(), "{ran:?}");
    let mut lines = words.lines();
    let number = lines.find_map(|line| line.strip_suffix(word));
    number.expect("a line").trim().parse().expect("a number")
}

#[test]
fn values_with_ages_cross_a_process_without_encoding() {
    let folder = tempfile::tempdir().expect("a folder");
    let ran = program(folder.path(), "").output().expect("an end");
    assert!(printed(&ran, " pairs") > 20, "{ran:?}");
    assert_eq!(printed(&ran, " decoded"), 0, "{ran:?}");
}

#[test]
fn values_with_ages_live_again_exactly() {
    run_in_its_process();
    let folder = tempfile::tempdir().expect("a folder");
    let recording = folder.path().join("aged.mcap");
    let program = |more: &str| program(folder.path(), more);
    let ran = program(&format!("--record\n{}", recording.display())).output();
    let ran = ran.expect("an end");
    let pairs = printed(&ran, " pairs");
    assert!(pairs > 20, "{pairs}");
    // A recording has bytes.
    assert!(printed(&ran, " decoded") > pairs, "{ran:?}");

    let file = std::fs::read(&recording).expect("a recording");
    let mut rest = &file[rc_mcap::MAGIC.len()..];
    let mut turns = Vec::new();
    while let Ok(Some((code, body))) = rc_mcap::read::next(&mut rest) {
        if code == MESSAGE {
            let turn = &body[DATA..];
            turns.extend((turn.len() as u32).to_le_bytes());
            turns.extend(turn);
        }
    }
    let mut child = program("--replay")
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("the program");
    let mut input = child.stdin.take().expect("its input");
    let writing = std::thread::spawn(move || input.write_all(&turns));
    let ran = child.wait_with_output().expect("an end");
    let _ = writing.join().expect("no panic");
    let words = String::from_utf8_lossy(&ran.stdout);
    let report = words.lines().rfind(|line| line.starts_with('{'));
    let report = report.unwrap_or_else(|| panic!("{words}"));
    let report: serde_json::Value = serde_json::from_str(report).expect("one document");
    assert_eq!(report["equal"], true, "{report}");
    assert!(report["compared"].as_u64() > Some(200), "{report}");
}
