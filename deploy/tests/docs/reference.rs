//! Pages and pictures that are made from the programs. `UPDATE_EXPECT=1` writes them again.

use crate::markdown::ROOT;
use expect_test::expect_file;
use std::path::{Path, PathBuf};
use std::process::Command;

/// A program of this test run.
fn path(program: &str) -> PathBuf {
    let programs = Path::new(env!("CARGO_BIN_EXE_rcdeploy")).parent();
    programs.expect("the target folder").join(program)
}

/// A source of a program that is newer than the program: cargo did not build it for this test.
fn newer_source(program: &Path) -> Option<PathBuf> {
    let changed = |path: &Path| path.metadata().and_then(|found| found.modified()).ok();
    // Cargo lists the sources beside the program.
    let listed = std::fs::read_to_string(program.with_extension("d")).ok()?;
    let built = changed(program)?;
    let (_, sources) = listed.split_once(": ")?;
    let mut sources = sources.split_whitespace().map(PathBuf::from);
    sources.find(|source| changed(source).is_some_and(|changed| changed > built))
}

/// Compares a page with what these programs say. If they are old, the reason is that they are.
fn compare(page: &str, made: &str, programs: &[&str]) {
    let page = Path::new(ROOT).join(page);
    let is_equal = std::fs::read_to_string(&page).is_ok_and(|text| text == made);
    for program in programs.iter().map(|program| path(program)) {
        let source = newer_source(&program).filter(|_| !is_equal);
        assert!(
            source.is_none(),
            "{} is older than {}: build it first, by `cargo build --workspace --bins` or `cargo xtask test`",
            program.display(),
            source.unwrap_or_default().display()
        );
    }
    expect_file![page].assert_eq(made);
}

/// The output of a program of this test run.
fn output(program: &str, args: &[&str]) -> String {
    let path = path(program);
    assert!(
        path.exists(),
        "{} is missing: run the tests by `cargo xtask test`",
        path.display()
    );
    let mut command = Command::new(&path);
    let output = command.args(args).current_dir(ROOT).output();
    let output = output.expect("a program that starts");
    assert!(output.status.success(), "{program} {args:?}: {output:?}");
    String::from_utf8(output.stdout).expect("a text")
}

/// A section of a help, such as `Options:`: each entry with its explanation in one line.
fn section(help: &str, title: &str) -> Vec<(String, String)> {
    let mut entries: Vec<(String, String)> = Vec::new();
    let lines = help.lines().skip_while(|line| *line != title).skip(1);
    for line in lines.take_while(|line| line.is_empty() || line.starts_with(' ')) {
        let text = line.trim_start();
        let depth = line.len() - text.len();
        match entries.last_mut() {
            // An entry is less indented than what explains it.
            Some((_, explained)) if depth > 6 || text.is_empty() => {
                if !explained.is_empty() && !text.is_empty() {
                    explained.push(' ');
                }
                explained.push_str(text);
            }
            _ if text.is_empty() => {}
            _ => {
                let (entry, text) = text.split_once("  ").unwrap_or((text, ""));
                entries.push((entry.to_owned(), text.trim().to_owned()));
            }
        }
    }
    entries
}

/// Adds the help of a command, and of its subcommands.
fn describe(program: &str, words: &[&str], page: &mut String) {
    let help = output(program, &[words, &["--help"]].concat());
    let level = "#".repeat(words.len() + 2);
    let name = [&[program], words].concat().join(" ");
    let (about, rest) = help.split_once("\nUsage: ").expect("a usage");
    let (usage, _) = rest.split_once("\n\n").expect("options");
    *page += &format!("\n{level} {name}\n\n{}\n\n", about.trim());
    let usage: Vec<&str> = usage.lines().map(str::trim).collect();
    *page += &format!("```text\nUsage: {}\n```\n", usage.join("\n       "));
    let mut listed = Vec::new();
    for title in ["Arguments:", "Options:"] {
        for (entry, text) in section(&help, title) {
            // A path of the machine that has built the program.
            let text = text.split(" [default: /").next().unwrap_or_default();
            if !entry.starts_with("-h, ") && !entry.starts_with("-V, ") {
                listed.push(format!("- `{entry}`: {text}\n"));
            }
        }
    }
    if !listed.is_empty() {
        *page += &format!("\n{}", listed.concat());
    }
    // Those of the tool are those of its commands.
    if words.is_empty() {
        let codes = section(&help, "Exit codes:");
        let codes: String = codes
            .iter()
            .map(|(c, text)| format!("- `{c}`: {text}\n"))
            .collect();
        *page += &format!("\nExit codes:\n\n{codes}");
    }
    for (next, _) in section(&help, "Commands:") {
        if next != "help" {
            describe(program, &[words, &[&next]].concat(), page);
        }
    }
}

#[test]
fn the_page_of_commands_is_up_to_date() {
    let mut page = "# Commands\n\nThe help of `rcgen`, of `rcdeploy`, and of a component. A test compares this page with the programs.\n"
        .to_owned();
    describe("rcgen", &[], &mut page);
    describe("rcdeploy", &[], &mut page);
    page += "\n## A component\n\nEvery generated component has the same options; the slots are its own.\n\n```text\n";
    page += output("simulator", &["--help"]).trim();
    page += "\n```\n";
    compare(
        "docs/commands.md",
        &page,
        &["rcgen", "rcdeploy", "simulator"],
    );
}

#[test]
fn the_picture_of_the_network_is_up_to_date() {
    let picture = output(
        "rcdeploy",
        &["graph", "components/networks/patrol.ddsl", "--unbuilt"],
    );
    compare("docs/images/patrol.svg", &picture, &["rcdeploy"]);
}

#[test]
fn the_picture_of_the_machine_is_up_to_date() {
    let picture = output("rcgen", &["graph", "components/avoider/avoider.scxml"]);
    compare("docs/images/avoider.svg", &picture, &["rcgen"]);
}
