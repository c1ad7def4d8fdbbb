//! `cargo xtask experiment`: the five tasks of the paper on the languages of RoboComp, as a script
//! of edits that runs with the real tools in a new workspace.
//!
//! Source: A. Romero-Garcés, L. J. Manso, M. A. Gutiérrez, R. Cintas, P. Bustos, "Improving the
//! lifecycle of robotics components using Domain-Specific Languages", section F: lines of code that
//! a developer writes, and the time. The time here is that of the tools.

mod boxes;
mod components;
mod strokes;
mod tasks;

use crate::programs::{Failure, cargo, finish, output, target};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};
use tasks::{Step, Task, Typed};

/// The limit of a command. The first one that builds compiles the framework.
const LIMIT: Duration = Duration::from_mins(20);
/// How long a component may take until its log shows the result of a task.
const SHOWN: Duration = Duration::from_mins(1);
/// How many lines of a log are read: all of this minute.
const LINES: &str = "100000";

/// The tasks over components of this repository, as box plots.
pub(crate) fn components(smoke: bool) -> Result<(), Failure> {
    components::run(smoke)
}

/// Does all tasks, and prints a table. With `smoke`, the builds are those of the test run.
pub(crate) fn run(smoke: bool) -> Result<(), Failure> {
    let target = target()?;
    if !smoke {
        let words = ["build", "--release", "--bin", "rcgen", "--bin", "rcdeploy"];
        finish(cargo(&words)?, LIMIT)?;
    }
    let folder = tempfile::tempdir()?;
    // Paths of sockets are short, and the folder for temporary files may have a long one.
    let runtime = tempfile::Builder::new()
        .prefix("rc-")
        .tempdir_in("/dev/shm")?;
    let name = format!("experiment_{}", std::process::id());
    // Copies, since other builds replace the programs in the target folder meanwhile.
    let tools = folder.path().join("bin");
    fs::create_dir_all(&tools)?;
    let built = target.join(if smoke { "debug" } else { "release" });
    for tool in ["rcgen", "rcdeploy"] {
        fs::copy(built.join(tool), tools.join(tool))?;
    }
    let workspace = Workspace {
        tools,
        root: folder.path().join(&name),
        target: if smoke {
            target
        } else {
            folder.path().join("target")
        },
        runtime: runtime.path().to_owned(),
        network: name,
        smoke,
    };
    println!("| task | descriptions | Rust | commands | lines typed | seconds of the tools |");
    println!("|---|---|---|---|---|---|");
    for task in tasks::all(&workspace.network) {
        let (typed, took) = workspace.perform(&task)?;
        println!(
            "| {} | {} | {} | {} | {} | {:.1} |",
            task.name,
            typed.descriptions,
            typed.rust,
            typed.commands,
            typed.sum(),
            took.as_secs_f64()
        );
    }
    Ok(())
}

/// The workspace in which the tasks are done.
struct Workspace {
    tools: PathBuf,
    root: PathBuf,
    target: PathBuf,
    runtime: PathBuf,
    network: String,
    smoke: bool,
}

impl Workspace {
    /// Does a task. Returns the typed lines, and the time of the tools.
    fn perform(&self, task: &Task) -> Result<(Typed, Duration), Failure> {
        let mut typed = Typed::default();
        let mut took = Duration::ZERO;
        let shown_by = task.shows.map(|(component, _)| component);
        // A log begins with the output of earlier tasks; before the first one, there is none.
        let before = shown_by.map(|component| self.log(component).unwrap_or_default().len());
        for step in &task.steps {
            typed.add(step);
            match step {
                Step::Write(file, text) => {
                    let path = self.root.join(file);
                    fs::create_dir_all(path.parent().unwrap_or(&self.root))?;
                    fs::write(path, text)?;
                }
                Step::Change(file, old, new) => self.change(file, old, new)?,
                Step::Command(words) => took += self.command(words)?,
                Step::Paste(component) => self.paste(component)?,
                Step::Up => {
                    let start = Instant::now();
                    self.up()?;
                    took += start.elapsed();
                }
            }
        }
        if let Some((component, text)) = task.shows {
            let shown = self.wait_for(component, text, before.unwrap_or_default());
            self.run(&["rcdeploy", "down", &self.network])?;
            shown?;
        }
        Ok((typed, took))
    }

    fn change(&self, file: &str, old: &str, new: &str) -> Result<(), Failure> {
        let path = self.root.join(file);
        let text = fs::read_to_string(&path)?;
        if text.matches(old).count() != 1 {
            return Err(format!("{file}: `{old}` is not there once:\n{text}").into());
        }
        Ok(fs::write(path, text.replace(old, new))?)
    }

    /// A command of the user that makes or generates something.
    fn command(&self, words: &[String]) -> Result<Duration, Failure> {
        let words: Vec<&str> = words.iter().map(String::as_str).collect();
        let start = Instant::now();
        self.run(&words)?;
        let took = start.elapsed();
        if self.smoke && words[1] == "init" {
            rc_test_support::share_builds(&self.root, Path::new("features"));
            self.change("Cargo.toml", "members = [", "members = [\"features\", ")?;
        }
        Ok(took)
    }

    /// Runs a tool with these words. Returns its output.
    fn run(&self, words: &[&str]) -> Result<String, Failure> {
        let folder = if self.root.exists() {
            &self.root
        } else {
            self.root.parent().unwrap_or(&self.root)
        };
        let mut command = Command::new(self.tools.join(words[0]));
        command
            .args(&words[1..])
            .current_dir(folder)
            .env("CARGO_TARGET_DIR", &self.target)
            .env("XDG_RUNTIME_DIR", &self.runtime)
            .env("XDG_STATE_HOME", self.root.with_file_name("state"))
            .stdin(Stdio::null());
        if self.smoke {
            // The test run has all crates already.
            command.env("CARGO_NET_OFFLINE", "true");
        }
        output(command, LIMIT)
    }

    fn up(&self) -> Result<(), Failure> {
        let file = format!("deployments/{}.ddsl", self.network);
        let mut words = vec!["rcdeploy", "up", "--build", "--detach", &file];
        if self.smoke {
            words.extend(["--profile", "dev"]);
        }
        self.run(&words).map(drop)
    }

    /// Pastes what `rcgen stubs` prints at the places that it names.
    fn paste(&self, component: &str) -> Result<(), Failure> {
        let cdsl = format!("components/{component}/{component}.cdsl");
        let stubs = self.run(&["rcgen", "stubs", &cdsl])?;
        let stubs = stubs.strip_prefix("// ").unwrap_or(&stubs);
        // From the last one to the first, so that line numbers stay right.
        let mut pieces: Vec<&str> = stubs.split("\n// ").collect();
        pieces.reverse();
        for piece in pieces {
            let (heading, code) = piece.split_once('\n').ok_or("a stub without code")?;
            let (file, place) = heading.split_once(':').ok_or("a stub without a file")?;
            let path = self.root.join(file);
            let text = fs::read_to_string(&path)?;
            let mut lines: Vec<&str> = text.lines().collect();
            let number = place
                .split(':')
                .next()
                .and_then(|n| n.parse::<usize>().ok());
            if let Some(number) = number {
                lines.insert(number, code.trim_end());
            } else if place.contains("into [dependencies]") {
                let table = lines.iter().position(|line| *line == "[dependencies]");
                lines.insert(table.ok_or("no [dependencies]")? + 1, code.trim_end());
            } else if place.contains("uses this") {
                let first = lines.iter().position(|line| line.starts_with("use "));
                lines.insert(first.ok_or("no `use`")?, code.trim_end());
            } else {
                lines.extend(["", code.trim_end()]);
            }
            fs::write(&path, lines.join("\n") + "\n")?;
        }
        Ok(())
    }

    fn log(&self, component: &str) -> Result<String, Failure> {
        self.run(&["rcdeploy", "logs", "-n", LINES, &self.network, component])
    }

    /// Waits until the log of a component contains `text` after its first `before` bytes.
    fn wait_for(&self, component: &str, text: &str, before: usize) -> Result<(), Failure> {
        let end = Instant::now() + SHOWN;
        loop {
            let log = self.log(component)?;
            let new = log.get(before..).unwrap_or(&log);
            if new.contains(text) {
                return Ok(());
            }
            if Instant::now() > end {
                return Err(format!("the log of {component} has no `{text}`:\n{new}").into());
            }
            std::thread::sleep(Duration::from_millis(20));
        }
    }
}
