//! The test programs of the workspace, and running several at a time.
//!
//! Cargo runs one program after the other. Most tests wait for processes that they have started, and
//! the last tests of a program run alone, so the processors would be idle for much of the time.

use crate::cargo_command;
use serde::Deserialize;
use std::collections::VecDeque;
use std::io::{BufRead as _, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};
use std::sync::mpsc::{RecvTimeoutError, SyncSender, sync_channel};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// How long the output of a program may stay open and silent after its end. A process that a test has
/// left may keep it open forever, and ten times as long if that one prints.
const LEFT_OPEN: Duration = Duration::from_secs(2);

/// A program with tests.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Program {
    executable: PathBuf,
    /// The folder of its package, in which it runs.
    folder: PathBuf,
    title: String,
    selection: String,
}

/// The output of a program: each line, and when it came.
pub(crate) struct Output {
    pub(crate) lines: Vec<(String, Duration)>,
    pub(crate) succeeded: bool,
}

/// A message of cargo about an artifact, of which only these members matter here.
#[derive(Deserialize)]
struct Artifact {
    executable: Option<PathBuf>,
    manifest_path: PathBuf,
    profile: Profile,
    target: Target,
}

#[derive(Deserialize)]
struct Profile {
    test: bool,
}

#[derive(Deserialize)]
struct Target {
    kind: Vec<String>,
    name: String,
    src_path: PathBuf,
}

/// Builds the test programs that the arguments of `cargo test` select, largest first: a large one that
/// begins last would run alone.
pub(crate) fn build(arguments: &[&str]) -> Result<Vec<Program>, String> {
    let words = ["--no-run", "--message-format", "json-render-diagnostics"];
    let words = [arguments, &words].concat();
    let mut cargo = cargo_command(&words, &[]);
    let output = cargo.stdout(Stdio::piped()).stderr(Stdio::inherit());
    let output = output
        .output()
        .map_err(|e| format!("cargo cannot be started: {e}"))?;
    if !output.status.success() {
        return Err(format!("cargo {} failed", words.join(" ")));
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let root = root.canonicalize().map_err(|e| format!("{e}"))?;
    let text = String::from_utf8_lossy(&output.stdout);
    let mut programs: Vec<(u64, Program)> = Vec::new();
    for line in text.lines() {
        if let Some(program) = program(line, &root) {
            let size = std::fs::metadata(&program.executable).map_or(0, |found| found.len());
            programs.push((size, program));
        }
    }
    programs.sort_by(|(a, one), (b, other)| b.cmp(a).then_with(|| one.title.cmp(&other.title)));
    Ok(programs.into_iter().map(|(_, program)| program).collect())
}

/// The test program in a message of cargo.
fn program(message: &str, root: &Path) -> Option<Program> {
    let built: Artifact = serde_json::from_str(message).ok()?;
    let executable = built.executable.filter(|_| built.profile.test)?;
    let folder = built.manifest_path.parent()?.to_owned();
    let name = &built.target.name;
    let target = match built.target.kind.first()?.as_str() {
        kind @ ("bin" | "test" | "bench" | "example") => format!("--{kind} {name}"),
        _ => "--lib".to_owned(),
    };
    let source = built.target.src_path.strip_prefix(&folder).ok()?;
    let unit = if target.starts_with("--test ") {
        ""
    } else {
        "unittests "
    };
    let shown = executable.strip_prefix(root).unwrap_or(&executable);
    Some(Program {
        title: format!("{unit}{} ({})", source.display(), shown.display()),
        selection: format!("-p {} {target}", package(&folder)?),
        executable,
        folder,
    })
}

/// The name of the package in a folder.
fn package(folder: &Path) -> Option<String> {
    let manifest = std::fs::read_to_string(folder.join("Cargo.toml")).ok()?;
    let name = manifest.lines().find_map(|l| l.strip_prefix("name = \""))?;
    Some(name.trim_end_matches('"').to_owned())
}

/// Runs the programs, `at_once` at a time, and one more after `beside` has run. It gives `each` a program
/// when it begins, then again with its output when it has ended.
pub(crate) fn run(
    programs: &[Program],
    at_once: usize,
    arguments: &[&str],
    environment: &[(&str, &str)],
    beside: impl FnOnce() + Send,
    mut each: impl FnMut(&Program, Option<Output>),
) {
    let start = Instant::now();
    let waiting: Mutex<VecDeque<&Program>> = Mutex::new(programs.iter().collect());
    let (sender, receiver) = sync_channel(0);
    let work = |sender: SyncSender<_>| {
        let next = || {
            let mut waiting = waiting.lock().unwrap_or_else(PoisonError::into_inner);
            waiting.pop_front()
        };
        while let Some(program) = next() {
            let begun = sender.send((program, None));
            let output = program.run(arguments, environment, start);
            if begun
                .and_then(|()| sender.send((program, Some(output))))
                .is_err()
            {
                break;
            }
        }
    };
    let work = &work;
    std::thread::scope(|scope| {
        for _ in 0..at_once.max(1) {
            let sender = sender.clone();
            scope.spawn(move || work(sender));
        }
        let last = sender.clone();
        scope.spawn(move || {
            beside();
            work(last);
        });
        drop(sender);
        for (program, output) in receiver {
            each(program, output);
        }
    });
}

impl Program {
    /// Runs it. Its output is that of cargo, so that a report reads both.
    fn run(&self, arguments: &[&str], environment: &[(&str, &str)], start: Instant) -> Output {
        let mut command = Command::new(&self.executable);
        command.args(arguments).envs(environment.iter().copied());
        // As cargo does; the rest of its environment is that of this program.
        command.env("CARGO_MANIFEST_DIR", &self.folder);
        command.current_dir(&self.folder).stdin(Stdio::null());
        let mut said = vec![(format!("     Running {}", self.title), start.elapsed())];
        let status = lines(command, |line| {
            said.push((line.to_owned(), start.elapsed()));
        });
        let why = match &status {
            Ok(status) if status.success() => None,
            Ok(status) => Some(status.to_string()),
            Err(error) => Some(format!("it cannot be started: {error}")),
        };
        if let Some(why) = &why {
            let at = start.elapsed();
            let rerun = format!("error: test failed, to rerun pass `{}`", self.selection);
            said.push((rerun, at));
            said.push((format!("  {}: {why}", self.executable.display()), at));
        }
        Output {
            lines: said,
            succeeded: why.is_none(),
        }
    }

    /// The line that cargo prints when it runs the program: source and executable.
    pub(crate) fn title(&self) -> &str {
        &self.title
    }

    /// The arguments of cargo that select this program alone.
    pub(crate) fn selection(&self) -> &str {
        &self.selection
    }
}

/// Runs `command`, and gives `line` each line of its output and of its errors, in one order.
pub(crate) fn lines(
    mut command: Command,
    mut line: impl FnMut(&str),
) -> std::io::Result<ExitStatus> {
    let (output, writer) = std::io::pipe()?;
    command.stdout(writer.try_clone()?).stderr(writer);
    let mut child = command.spawn()?;
    // It has the other ends of the pipe.
    drop(command);
    let (sender, receiver) = sync_channel(64);
    std::thread::spawn(move || {
        let lines = BufReader::new(output).split(b'\n').map_while(Result::ok);
        for line in lines {
            if sender.send(line).is_err() {
                break;
            }
        }
    });
    let mut ended: Option<(ExitStatus, Instant)> = None;
    loop {
        // What the program itself has said is read to its end, also on a machine that stood still.
        let limit = match receiver.recv_timeout(Duration::from_millis(200)) {
            Ok(bytes) => {
                line(&String::from_utf8_lossy(&bytes));
                LEFT_OPEN * 10
            }
            Err(RecvTimeoutError::Timeout) => LEFT_OPEN,
            Err(RecvTimeoutError::Disconnected) => return child.wait(),
        };
        match ended {
            None => ended = child.try_wait()?.map(|status| (status, Instant::now())),
            Some((status, at)) if at.elapsed() > limit => return Ok(status),
            Some(_) => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_of_cargo_tell_programs() {
        let folder = env!("CARGO_MANIFEST_DIR");
        let message = |kind: &str, name: &str, source: &str, test: bool| {
            format!(
                r#"{{"reason":"compiler-artifact","manifest_path":"{folder}/Cargo.toml","executable":"/t/debug/deps/x-1",
                "target":{{"kind":["{kind}"],"name":"{name}","src_path":"{folder}/{source}"}},"profile":{{"test":{test}}}}}"#
            )
        };
        let told = |message: &str| {
            let program = program(message, Path::new("/t"))?;
            Some((program.title, program.selection))
        };
        let of = |title: &str, selection: &str| Some((title.to_owned(), selection.to_owned()));
        assert_eq!(
            told(&message("test", "all", "tests/all/main.rs", true)),
            of("tests/all/main.rs (debug/deps/x-1)", "-p xtask --test all")
        );
        assert_eq!(
            told(&message("bin", "xtask", "src/main.rs", true)),
            of(
                "unittests src/main.rs (debug/deps/x-1)",
                "-p xtask --bin xtask"
            )
        );
        assert_eq!(
            told(&message("lib", "a", "src/lib.rs", true)),
            of("unittests src/lib.rs (debug/deps/x-1)", "-p xtask --lib")
        );
        assert_eq!(told(&message("bin", "xtask", "src/main.rs", false)), None);
        assert_eq!(told(r#"{"reason":"build-finished","success":true}"#), None);
    }

    /// The output of programs that run at the same time is not mixed.
    #[test]
    fn programs_run_at_once_and_each_one_is_told_as_a_whole() {
        let folder = std::env::temp_dir().join(format!("rc-programs-{}", std::process::id()));
        let program = |name: &str| {
            std::fs::create_dir_all(folder.join(name)).expect("a folder");
            Program {
                executable: "/bin/sh".into(),
                folder: folder.join(name),
                title: name.to_owned(),
                selection: format!("-p {name} --lib"),
            }
        };
        let programs = ["one", "other"].map(program);
        // Each waits for the other, so they end only if both run.
        let script = "echo begin $0; : > here; for i in $(seq 1200); do \
             [ -e ../one/here ] && [ -e ../other/here ] && break; sleep 0.05; done\n\
             [ -e ../one/here ] && [ -e ../other/here ] && echo end; [ ${PWD##*/} = one ]";
        let mut told = Vec::new();
        let arguments = ["-c", script, "word"];
        run(
            &programs,
            1,
            &arguments,
            &[],
            || (),
            |program, output| {
                let Some(output) = output else { return };
                let lines: Vec<String> = output.lines.into_iter().map(|(line, _)| line).collect();
                told.push((program.title.clone(), output.succeeded, lines));
            },
        );
        std::fs::remove_dir_all(&folder).expect("to remove");
        told.sort();
        let lines = |name: &str| {
            [
                format!("     Running {name}"),
                "begin word".to_owned(),
                "end".to_owned(),
            ]
        };
        assert_eq!(told[0], ("one".to_owned(), true, lines("one").to_vec()));
        let (name, succeeded, said) = &told[1];
        assert_eq!(
            (name.as_str(), *succeeded, &said[..3]),
            ("other", false, &lines("other")[..])
        );
        assert_eq!(
            said[3],
            "error: test failed, to rerun pass `-p other --lib`"
        );
        assert_eq!(said[4], "  /bin/sh: exit status: 1");
    }
}
