//! Help and man pages of both tools.

use rc_test_site::site::Site;
use rc_test_support::python::skipped;
use std::path::Path;
use std::process::Command;

const COMMANDS: &str = include_str!("../../../docs/commands.md");

/// Runs a tool, which must succeed, and returns what it prints.
fn output(program: &Path, arguments: &[&str]) -> String {
    let output = Command::new(program).args(arguments).output();
    let output = output.unwrap_or_else(|error| panic!("{}: {error}", program.display()));
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(
        (output.status.code(), &*stderr),
        (Some(0), ""),
        "{arguments:?}"
    );
    String::from_utf8(output.stdout).expect("text")
}

/// The lines of a help that list exit codes, as code and meaning.
fn exit_codes(help: &str) -> Vec<(String, String)> {
    let (_, list) = help.split_once("Exit codes:\n").expect("exit codes");
    let lines = list
        .lines()
        .map(|line| line.trim().split_once("  ").expect("code and meaning"));
    lines
        .map(|(code, meaning)| (code.to_owned(), meaning.to_owned()))
        .collect()
}

#[test]
fn each_command_has_a_man_page_and_both_list_the_exit_codes() {
    let folder = tempfile::tempdir().expect("a folder");
    let place = folder.path().join("share/man/man1");
    let groff = Command::new("groff").arg("--version").output().is_ok();
    if !groff {
        skipped("man pages have no warnings", "there is no groff");
    }
    for tool in ["rcgen", "rcdeploy"] {
        let program = Site::executable(tool);
        let written = output(&program, &["man", place.to_str().expect("text")]);
        assert!(written.lines().count() > 10, "{written}");
        let all = exit_codes(&output(&program, &["--help"]));
        for (code, meaning) in &all {
            let documented = COMMANDS
                .lines()
                .any(|line| line == format!("- `{code}`: {meaning}"));
            assert!(documented, "docs/commands.md: {tool} {code} {meaning}");
        }
        let numbers: Vec<&str> = all.iter().map(|(code, _)| code.as_str()).collect();
        assert_eq!(numbers, ["0", "1", "2", "3"]);
        for line in written.lines() {
            let page = Path::new(line.strip_prefix("create ").expect("a new page"));
            let name = page
                .file_stem()
                .and_then(|name| name.to_str())
                .expect("a name");
            // A command may have a `-` in its name.
            let titles = COMMANDS
                .lines()
                .map(|line| line.trim_start_matches('#').trim());
            let mut titles = titles.filter(|title| title.replace(' ', "-") == name);
            let title = titles.next().unwrap_or(name);
            let mut words: Vec<&str> = title.split(' ').skip(1).collect();
            words.push("--help");
            assert_eq!(exit_codes(&output(&program, &words)), all, "{name}");
            let text = std::fs::read_to_string(page).expect("a page");
            assert!(text.is_ascii(), "{name}");
            let (_, status) = text.split_once(".SH \"EXIT STATUS\"").expect("the section");
            for (code, meaning) in &all {
                let meaning = meaning.replace('-', "\\-");
                let entry = format!(".TP\n\\fB{code}\\fR\n{meaning}\n");
                assert!(status.contains(&entry), "{name}: {entry}\n{status}");
            }
            if groff {
                let page = page.to_str().expect("text");
                output(Path::new("groff"), &["-man", "-ww", "-z", page]);
            }
        }
        // The second time, nothing changes.
        let again = output(&program, &["man", place.to_str().expect("text")]);
        assert!(
            again.lines().all(|line| line.starts_with("keep ")),
            "{again}"
        );
    }
}

#[test]
fn a_mistyped_command_is_answered_with_the_nearest_one() {
    for (typed, meant) in [("chekc", "check"), ("exprot", "export"), ("grahp", "graph")] {
        let output = Command::new(env!("CARGO_BIN_EXE_rcdeploy"))
            .arg(typed)
            .output();
        let output = output.expect("to run");
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{stderr}");
        let tip = format!("a similar subcommand exists: '{meant}'");
        assert!(stderr.contains(&tip), "{stderr}");
    }
}
