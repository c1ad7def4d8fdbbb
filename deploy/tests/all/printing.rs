//! Output that cannot be written: the exit code still reports the result of the command.

use std::fs::File;
use std::process::{Command, Stdio};

/// Runs rcdeploy with both output streams on a full disk. Returns its exit code.
fn on_a_full_disk(arguments: &[&str]) -> Option<i32> {
    let full = || {
        Stdio::from(
            File::options()
                .write(true)
                .open("/dev/full")
                .expect("Linux has it"),
        )
    };
    let mut command = Command::new(env!("CARGO_BIN_EXE_rcdeploy"));
    command.args(arguments).stdout(full()).stderr(full());
    command.status().expect("it runs").code()
}

#[test]
fn unprintable_diagnostics_still_set_the_exit_code() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("wrong.ddsl");
    std::fs::write(&file, "network wrong { component }").expect("written");
    let file = file.to_str().expect("text");
    for command in ["check", "plan", "graph", "up"] {
        assert_eq!(on_a_full_disk(&[command, file]), Some(1), "{command}");
    }
    let status = on_a_full_disk(&["status", "no-such-network"]);
    assert_eq!(status, Some(3));
}
