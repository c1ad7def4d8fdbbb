//! Child processes with a time limit, ended when they are dropped.

use rustix::process::{Pid, Signal, kill_process};
use std::io::{BufRead as _, BufReader, Write as _};
use std::os::unix::process::CommandExt as _;
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

/// Any error: it is only reported.
pub(crate) type Failure = Box<dyn std::error::Error>;

/// The time a program has to end after SIGTERM.
pub(crate) const END: Duration = Duration::from_secs(2);
/// The time it has to end after the end of its standard input.
const INPUT_END: Duration = Duration::from_millis(300);
/// The interval of polling for the end of a program.
pub(crate) const LOOK: Duration = Duration::from_millis(2);

/// The root of the workspace.
pub(crate) fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// The target folder of cargo, in which this program is.
pub(crate) fn target() -> Result<PathBuf, Failure> {
    let own = std::env::current_exe()?;
    let target = own.parent().and_then(Path::parent);
    Ok(target
        .ok_or("this program is not in a target folder")?
        .into())
}

/// `cargo` with these arguments, in the workspace.
pub(crate) fn cargo(words: &[&str]) -> Result<Command, Failure> {
    let mut command = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command.args(words).current_dir(root());
    command.env("CARGO_TARGET_DIR", target()?);
    Ok(command)
}

/// Runs a command to its end, at most for `limit`. Returns its duration and its output on stderr.
pub(crate) fn finish(command: Command, limit: Duration) -> Result<(Duration, String), Failure> {
    let ended = end_of(command, limit, Stdio::null())?;
    Ok((ended.took, ended.errors))
}

/// [`finish`], but returns the output on stdout.
pub(crate) fn output(command: Command, limit: Duration) -> Result<String, Failure> {
    let stdout = tempfile::tempfile()?;
    end_of(command, limit, stdout.try_clone()?.into())?;
    Ok(read_back(stdout)?)
}

/// Tests in their long form: a title, the arguments that select them, with those of the test program after `--`, and the variables
/// that make them long.
pub(crate) type LongTest = (
    &'static str,
    &'static str,
    &'static [(&'static str, &'static str)],
);

/// Runs tests in their long form, each at most for `limit`.
pub(crate) fn long_tests(tests: &[LongTest], limit: Duration) -> Result<(), Failure> {
    for (what, test, variables) in tests {
        let variables = variables.iter();
        let variables = variables.map(|(name, value)| (*name, Path::new(value)));
        tested(what, test, variables, limit)?;
    }
    Ok(())
}

/// Runs the tests that the arguments `test` select, at most for `limit`, and prints whether they passed
/// or were skipped. Fails if the arguments select none.
pub(crate) fn tested<'a>(
    what: &str,
    test: &str,
    variables: impl IntoIterator<Item = (&'a str, &'a Path)>,
    limit: Duration,
) -> Result<(), Failure> {
    let words: Vec<&str> = ["test", "-q", "--no-fail-fast"].into();
    let separator = if test.contains(" -- ") { "" } else { "--" };
    let more = test.split(' ').chain([separator, "--nocapture"]);
    let more = more.filter(|word| !word.is_empty());
    let mut command = cargo(&words.into_iter().chain(more).collect::<Vec<_>>())?;
    command.envs(variables);
    let stdout = tempfile::tempfile()?;
    let ended = end_of(command, limit, stdout.try_clone()?.into())?;
    let told = read_back(stdout)?;
    print!("{told}");
    let mut results = told
        .lines()
        .filter_map(|l| l.strip_prefix("test result: ok. "));
    if !results.any(|counts| !counts.starts_with("0 passed")) {
        return Err(format!("{what}: no test fits `{test}`").into());
    }
    // Most tests say on standard error that they are skipped.
    let skipped = ended.errors.lines().filter(|l| l.starts_with("skipped: "));
    let skipped: Vec<&str> = skipped.collect();
    for line in &skipped {
        println!("{line}");
    }
    let is_whole = skipped.is_empty() && !told.contains("skipped:");
    let word = if is_whole {
        "passed"
    } else {
        "skipped in part"
    };
    println!("{what}: {word}, {:.0} s", ended.took.as_secs_f64());
    Ok(())
}

struct Ended {
    took: Duration,
    errors: String,
}

fn end_of(mut command: Command, limit: Duration, stdout: Stdio) -> Result<Ended, Failure> {
    let what = format!("{command:?}");
    let stderr = tempfile::tempfile()?;
    command
        .stdin(Stdio::null())
        .stdout(stdout)
        .stderr(stderr.try_clone()?);
    let start = Instant::now();
    let mut running = Running(command.spawn()?);
    let (done, ended) = channel();
    let mut waited = None;
    std::thread::scope(|scope| {
        // A thread that blocks in `wait` measures exactly, and the limit still holds.
        let child = &mut running.0;
        let pid = Pid::from_child(child);
        scope.spawn(move || done.send((child.wait(), start.elapsed())));
        waited = ended.recv_timeout(limit).ok();
        if waited.is_none() {
            let _ = kill_process(pid, Signal::KILL);
        }
    });
    let Some((status, took)) = waited else {
        return Err(format!("{what} took longer than {limit:?}").into());
    };
    let errors = read_back(stderr)?;
    if status?.success() {
        Ok(Ended { took, errors })
    } else {
        Err(format!("{what} failed:\n{errors}").into())
    }
}

fn read_back(mut file: std::fs::File) -> std::io::Result<String> {
    use std::io::{Read as _, Seek as _};
    let mut text = String::new();
    file.rewind()?;
    file.read_to_string(&mut text)?;
    Ok(text)
}

/// A child process. On drop it gets SIGTERM, then SIGKILL.
pub(crate) struct Running(pub(crate) Child);

impl Running {
    /// Waits for its end. Returns `false` if it still runs after `limit`.
    pub(crate) fn ended_within(&mut self, limit: Duration) -> bool {
        let end = Instant::now() + limit;
        loop {
            if matches!(self.0.try_wait(), Ok(Some(_))) {
                return true;
            }
            if Instant::now() >= end {
                return false;
            }
            std::thread::sleep(LOOK);
        }
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        if self.ended_within(INPUT_END) {
            return;
        }
        let _ = kill_process(Pid::from_child(&self.0), Signal::TERM);
        if self.ended_within(END) {
            return;
        }
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A program with a protocol of lines over pipes.
pub(crate) struct Program {
    name: String,
    lines: Receiver<String>,
    orders: ChildStdin,
    child: Running,
}

impl Program {
    /// Starts it.
    pub(crate) fn start(path: &Path, arguments: &[&str]) -> Result<Self, Failure> {
        let mut command = Command::new(path);
        command.args(arguments);
        Self::spawn(command)
    }

    /// Starts it in a process group of its own: signals of the terminal to this process do not
    /// reach it. It must end by itself when its output has no reader.
    pub(crate) fn start_apart(path: &Path, arguments: &[&str]) -> Result<Self, Failure> {
        let mut command = Command::new(path);
        command.args(arguments).process_group(0);
        Self::spawn(command)
    }

    /// Starts a command.
    pub(crate) fn spawn(mut command: Command) -> Result<Self, Failure> {
        let name = command.get_program().to_string_lossy().into_owned();
        let child = command
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .map_err(|error| format!("{name} cannot be started: {error}"))?;
        let mut child = Running(child);
        let orders = child.0.stdin.take().ok_or("no pipe")?;
        let output = child.0.stdout.take().ok_or("no pipe")?;
        let (sender, lines) = channel();
        std::thread::spawn(move || {
            for line in BufReader::new(output).lines().map_while(Result::ok) {
                if sender.send(line).is_err() {
                    return;
                }
            }
        });
        Ok(Self {
            name,
            lines,
            orders,
            child,
        })
    }

    /// The process of the program.
    pub(crate) fn pid(&self) -> u32 {
        self.child.0.id()
    }

    /// Writes one line to its standard input.
    pub(crate) fn write_line(&mut self, line: &str) -> Result<(), Failure> {
        writeln!(self.orders, "{line}").map_err(|error| format!("{}: {error}", self.name).into())
    }

    /// Waits for the next line of its output.
    pub(crate) fn read_line(&self, limit: Duration) -> Result<String, Failure> {
        let line = self.lines.recv_timeout(limit);
        line.map_err(|_| format!("{} printed nothing within {limit:?}", self.name).into())
    }

    /// The lines since the last call. Fails if the program has ended.
    pub(crate) fn read_lines(&mut self) -> Result<Vec<String>, Failure> {
        let lines = self.lines.try_iter().collect();
        match self.child.0.try_wait()? {
            Some(status) => Err(format!("{} has ended by itself: {status}", self.name).into()),
            None => Ok(lines),
        }
    }

    /// Ends it by closing its standard input, or else by SIGTERM. Ignores its exit status.
    pub(crate) fn stop(mut self, limit: Duration) -> Result<(), Failure> {
        drop(self.orders);
        if self.child.ended_within(INPUT_END) {
            return Ok(());
        }
        kill_process(Pid::from_child(&self.child.0), Signal::TERM)?;
        if self.child.ended_within(limit) {
            Ok(())
        } else {
            Err(format!("{} does not end within {limit:?}", self.name).into())
        }
    }

    /// Kills it with SIGKILL.
    pub(crate) fn kill(mut self) -> Result<(), Failure> {
        self.child.0.kill()?;
        self.child.0.wait()?;
        Ok(())
    }

    /// Sends SIGTERM and waits for the end. Returns the remaining lines. Fails if the program is
    /// still running after `limit`, or exits with an error.
    pub(crate) fn end(mut self, limit: Duration) -> Result<Vec<String>, Failure> {
        kill_process(Pid::from_child(&self.child.0), Signal::TERM)?;
        if !self.child.ended_within(limit) {
            return Err(format!("{} does not end within {limit:?}", self.name).into());
        }
        let status = self.child.0.wait()?;
        if !status.success() {
            return Err(format!("{} failed: {status}", self.name).into());
        }
        // Its end of the pipe is closed, so the reading thread ends.
        let end = Instant::now() + limit;
        let left = || end.saturating_duration_since(Instant::now());
        Ok(std::iter::from_fn(|| self.lines.recv_timeout(left()).ok()).collect())
    }
}
