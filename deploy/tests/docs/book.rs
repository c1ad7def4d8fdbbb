//! The commands on the pages run, in the order of the book, in one shell.
//!
//! A block ```` ```console ```` holds commands after `$
//! `, each with lines of its output in their order. `…` stands for any text, and alone for any lines. All commands succeed. Marks behind the tag say otherwise:
//!
//! - `runs`: the last command of the block runs until a line `^C`, or until the page ends. It must
//!   become ready, and not end before.
//! - `fails`: the last command of the block fails.
//! - `not-run=REASON`: this machine need not be able to run it.
//! - `installed`: `cargo xtask soak packages` runs it, too, where nothing but the packages is installed.
//!
//! A code block whose first line is a comment with a path is a file, which is written before the
//! commands after it; a function of Rust takes its place in the file. A block ````
//! ```rust,module ```` is compiled, and its tests run, in a module of a test of `guard`.

use crate::markdown::{Block, Page, ROOT, book};
use crate::session::Session;
use rc_test_support::share_builds;
use std::fs;
use std::os::unix::fs::symlink;
use std::path::Path;

/// The workspace that the page of the first component makes.
const WORKSPACE: &str = "my_robot";

/// Commands, each with the lines shown below it. A line `^C` is a command, too.
fn commands(text: &str) -> Vec<(String, Vec<&str>)> {
    let mut all: Vec<(String, Vec<&str>)> = Vec::new();
    for line in text.lines() {
        match (line.strip_prefix("$ "), line) {
            (Some(command), _) => all.push((command.to_owned(), Vec::new())),
            (None, "^C") => all.push((line.to_owned(), Vec::new())),
            (None, "" | "…") => {}
            (None, shown) => match all.last_mut() {
                // The command goes on.
                Some((command, _)) if command.ends_with('\\') => {
                    *command += "\n";
                    *command += shown;
                }
                Some((_, lines)) => lines.push(shown),
                None => panic!("no command before `{shown}`"),
            },
        }
    }
    all
}

/// Whether a line of output is the one shown, with `…` for any text.
fn fits(shown: &str, line: &str) -> bool {
    let mut rest = line.trim();
    for (at, part) in shown.trim().split('…').enumerate() {
        match rest.find(part) {
            Some(found) if at > 0 || found == 0 => rest = &rest[found + part.len()..],
            _ => return false,
        }
    }
    rest.is_empty() || shown.trim().ends_with('…')
}

/// The first line shown that the output does not have, behind those before it.
fn missing<'a>(shown: &[&'a str], output: &str) -> Option<&'a str> {
    let mut lines = output.lines();
    shown
        .iter()
        .find(|shown| !lines.any(|line| fits(shown, line)))
        .copied()
}

/// Writes a file of the page into the workspace.
fn write(block: &Block, home: &Path) -> Result<(), String> {
    let name = block.file().expect("a file");
    let path = home.join(WORKSPACE).join(name);
    let (_, text) = block.text.split_once('\n').expect("a first line");
    // The place of the clone that the pages name.
    let root = Path::new(ROOT).canonicalize().expect("this project");
    let text = text.replace("/home/me/robocomp", &root.to_string_lossy());
    let function = text.lines().find_map(|line| {
        let name = line.trim_start().strip_prefix("fn ")?;
        name.split('(').next()
    });
    let (Some(function), true) = (function, text.starts_with("    ")) else {
        fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        return fs::write(&path, text).map_err(|error| format!("{name}: {error}"));
    };
    let old = fs::read_to_string(&path).map_err(|error| format!("{name}: {error}"))?;
    let begin = format!("    fn {function}(");
    let new = if let Some((before, rest)) = old.split_once(&begin) {
        let (_, after) = rest.split_once("\n    }\n").expect("its end");
        format!("{before}{text}{after}")
    } else {
        // A new function of the worker.
        let worker = old.find("impl Worker<Context> for SpecificWorker {");
        let worker = worker.expect("a worker");
        let end = worker + old[worker..].find("\n}\n").expect("its end");
        format!("{}\n\n{text}{}", &old[..end], &old[end + 1..])
    };
    fs::write(&path, new).map_err(|error| format!("{name}: {error}"))
}

/// Prelude of blocks with the mark `module`.
const PRELUDE: &str = "#![allow(dead_code, unused_imports, reason = \"parts of pages\")]\n";
const MODULE: &str = "\nuse guard::SpecificWorker;\nuse guard_generated::network_time::Time;\nuse guard_generated::testing::*;\n\
                      use guard_generated::tracing::info;\nuse guard_generated::*;\nuse std::sync::mpsc;\nuse std::thread;\n\
                      use std::time::Duration;\n";

/// Adds the block to the modules of a test in the workspace.
fn add_module(block: &Block, home: &Path) -> Result<(), String> {
    let path = home.join(WORKSPACE).join("components/guard/tests/pages.rs");
    let modules = fs::read_to_string(&path).unwrap_or_else(|_| PRELUDE.to_owned());
    let number = modules.matches("mod block_").count();
    let text = format!("{modules}mod block_{number} {{{MODULE}{}}}\n", block.text);
    fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
    fs::write(&path, text).map_err(|error| error.to_string())
}

/// The command that waits until the component that `command` starts by hand is ready.
fn probe(command: &str) -> Option<String> {
    let words: Vec<&str> = command.split_whitespace().collect();
    let value = |option| {
        let at = words.iter().position(|word| *word == option)?;
        words.get(at + 1).map(|word| word.trim_end_matches(')'))
    };
    let (program, network) = (value("--bin")?, value("--network")?);
    let name = value("--name").unwrap_or(program);
    Some(format!(
        "\"$PROGRAMS/{program}\" --probe --wait 120 --network {network} --name {name}"
    ))
}

fn run(session: &mut Session, block: &Block) -> Result<(), String> {
    if block.value("not-run").is_some_and(|why| why.contains('-')) {
        return Ok(());
    }
    let known = |mark: &String| ["runs", "fails", "installed"].contains(&&**mark);
    if let Some(mark) = block.marks.iter().find(|mark| !known(mark)) {
        return Err(format!("the mark `{mark}` is not known"));
    }
    let commands = commands(&block.text);
    let last = commands.len().checked_sub(1).ok_or("no command")?;
    for (at, (command, shown)) in commands.iter().enumerate() {
        let told = |what: String| format!("`{command}` {what}");
        if command == "^C" {
            session.interrupt()?;
            continue;
        }
        let output = if at == last && block.has("runs") {
            let ready = if command.contains(" up ") {
                " is up"
            } else {
                ""
            };
            let output = session.start(command, ready).map_err(told)?;
            if let Some(probe) = probe(command) {
                let (code, state) = session.run(&probe).map_err(told)?;
                if code != 0 {
                    return Err(told(format!("does not become ready: {state}")));
                }
            }
            output
        } else {
            let (code, output) = session.run(command).map_err(told)?;
            if (code != 0) != (at == last && block.has("fails")) {
                return Err(told(format!("ends with {code}:\n{output}")));
            }
            output
        };
        if let Some(line) = missing(shown, &output) {
            return Err(told(format!("does not print `{line}`:\n{output}")));
        }
    }
    Ok(())
}

fn read(session: &mut Session, page: &Page) -> Vec<String> {
    let mut faults = Vec::new();
    for block in page.blocks() {
        let outcome = if block.tag == "console" {
            run(session, &block)
        } else if block.file().is_some_and(|name| name.contains('/')) {
            write(&block, &session.home())
        } else if block.has("module") {
            add_module(&block, &session.home())
        } else {
            Ok(())
        };
        if let Err(fault) = outcome {
            faults.push(format!("{}: {fault}", block.place));
        }
        // As soon as the page has made the workspace.
        let workspace = session.home().join(WORKSPACE);
        let features = Path::new("components/features");
        if workspace.join("Cargo.toml").exists() && !workspace.join(features).exists() {
            share_builds(&workspace, features);
        }
    }
    while session.anything_runs() {
        if let Err(fault) = session.interrupt() {
            faults.push(format!("{}: {fault}", page.path));
        }
    }
    faults
}

#[test]
fn every_command_runs() {
    let mut session = Session::new();
    let workspace = session.home().join(WORKSPACE);
    symlink(ROOT, session.home().join("robocomp")).expect("a link");
    // A part of a page's name, to try one page. The first component is there for all.
    let only = std::env::var("RC_PAGE").unwrap_or_default();
    let mut faults = Vec::new();
    for page in book() {
        if !page.path.contains(&only) && page.path != "docs/first-component.md" {
            continue;
        }
        // Pages say where their commands are typed; most are about the workspace.
        let here = page
            .text
            .replace('\n', " ")
            .contains("in the folder of this project");
        let folder = if here { Path::new(ROOT) } else { &workspace };
        let folder = folder.display();
        session.run(&format!("cd {folder}")).expect("a folder");
        faults.extend(read(&mut session, &page));
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}
