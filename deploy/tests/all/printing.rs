//! Output that cannot be written: the exit code still reports the result of the command.

use rc_test_site::site::Site;
use std::fs::File;
use std::path::Path;
use std::process::{Command, Stdio};

/// Runs rcdeploy with both output streams on a full disk. Returns its exit code.
fn on_a_full_disk(arguments: &[&str]) -> Option<i32> {
    program_on_a_full_disk(Path::new(env!("CARGO_BIN_EXE_rcdeploy")), arguments)
}

fn program_on_a_full_disk(program: &Path, arguments: &[&str]) -> Option<i32> {
    let full = || {
        Stdio::from(
            File::options()
                .write(true)
                .open("/dev/full")
                .expect("Linux has it"),
        )
    };
    let mut command = Command::new(program);
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

/// A network of one component, which nobody has built.
fn network(folder: &Path) -> String {
    let write = |name: &str, text: &str| {
        std::fs::write(folder.join(name), text).expect("written");
    };
    let cdsl = "Component c { Communications { }; language rust; };";
    write("c.cdsl", cdsl);
    let ddsl =
        r#"Deployment plain { Component c { cdsl "c.cdsl"; env { A "\u{1b}[2J\u{202e}x"; }; }; };"#;
    write("plain.ddsl", ddsl);
    folder.join("plain.ddsl").to_str().expect("text").to_owned()
}

#[test]
fn what_cannot_be_printed_is_a_failure_and_a_closed_pipe_is_none() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = network(folder.path());
    for arguments in [
        &["plan", "--unbuilt", &file][..],
        &["plan", "--unbuilt", "--format", "json", &file],
        &["graph", "--unbuilt", &file],
        &["completions", "bash"],
        &["--help"],
    ] {
        assert_eq!(on_a_full_disk(arguments), Some(3), "{arguments:?}");
        let (reader, writer) = std::io::pipe().expect("a pipe");
        drop(reader);
        let mut command = Command::new(env!("CARGO_BIN_EXE_rcdeploy"));
        let output = command.args(arguments).stdout(writer).output();
        let output = output.expect("it runs");
        assert_eq!(output.status.code(), Some(0), "{arguments:?}: {output:?}");
    }
}

#[test]
fn components_say_that_they_cannot_print_as_the_tools_do() {
    let component = Site::executable("pose_monitor");
    for arguments in ["--help", "--version", "--check"] {
        let arguments = &[arguments];
        let code = program_on_a_full_disk(&component, arguments);
        assert_eq!(code, Some(3), "{arguments:?}");
    }
    let (reader, writer) = std::io::pipe().expect("a pipe");
    drop(reader);
    // A closed pipe is not a failure, and makes no other answer of one: 3 is "not there".
    for (arguments, code) in [
        (&["--help"][..], 0),
        (&["--probe", "--network", "no_such_network"], 3),
    ] {
        let writer = writer.try_clone().expect("a copy");
        let mut command = Command::new(&component);
        let output = command.args(arguments).stdout(writer).output();
        let output = output.expect("it runs");
        assert_eq!(output.status.code(), Some(code), "{output:?}");
        assert!(output.stderr.is_empty(), "{output:?}");
    }
}

/// A program of several components says it once, whether it prints itself or one of them does.
#[test]
fn several_components_of_a_program_say_once_that_they_cannot_print() {
    let program =
        Path::new(env!("CARGO_BIN_EXE_rc-test-misbehave")).with_file_name("rc-test-together");
    for arguments in [&["--help"][..], &["--member", "neighbour", "--version"]] {
        let full = File::options().write(true).open("/dev/full");
        let mut command = Command::new(&program);
        let output = command.args(arguments).stdout(full.expect("Linux has it"));
        let output = output.output().expect("it runs");
        let said = String::from_utf8(output.stderr).expect("UTF-8");
        assert_eq!(output.status.code(), Some(3), "{arguments:?}: {said}");
        assert_eq!(
            said.matches("cannot write").count(),
            1,
            "{arguments:?}: {said}"
        );
    }
}

#[test]
fn a_plan_sends_no_escape_sequences_to_the_terminal() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = network(folder.path());
    let mut command = Command::new(env!("CARGO_BIN_EXE_rcdeploy"));
    let output = command.args(["plan", "--unbuilt", &file]).output();
    let output = output.expect("it runs");
    let text = String::from_utf8(output.stdout).expect("UTF-8");
    assert!(text.contains(r"\u{1b}[2J\u{202e}x"), "{text}");
    assert!(!text.contains(['\u{1b}', '\u{202e}']), "{text}");
}
