//! The place of a run: a folder with networks of its own, and what an outside observer sees of
//! them.

use super::shim::Shim;
use crate::programs::{Failure, root, target};
use rc_management::{Client, component};
use rc_middleware::RunDirectory;
use rustix::process::{Pid, PidfdFlags, Signal, pidfd_open, pidfd_send_signal};
use serde_json::Value;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// The name of the network and of its deployment.
pub(super) const NETWORK: &str = "chaos";
/// The name of the network whose components are threads of one process. The tests have its program,
/// of `deploy/tests/programs/in_one.ddsl`.
const IN_ONE: &str = "patrol_in_one";
/// The components, in the order of their start.
pub(super) const NAMES: [&str; 3] = ["simulator", "monitor", "avoider"];
/// The source of simulated time of a network under load.
pub(super) const CLOCK: &str = "clock";
/// The programs of the components.
pub(super) const PROGRAMS: [&str; 3] = ["simulator", "pose_monitor", "avoider"];

/// The limit until all components work again: what takes longer hangs, on the slowest machine.
pub(super) const RECOVERY: Duration = Duration::from_mins(1);
/// The limit for an end.
pub(super) const END: Duration = Duration::from_mins(1);
/// The limit for an answer of a component.
const ANSWER: Duration = Duration::from_secs(10);
/// The time that a component has to become ready, as the network says. The goal is far below it.
const READY: &str = "60s";
/// How many bytes of a log an error shows.
const LOG_END: usize = 4000;
/// The pause between two polls.
pub(super) const LOOK: Duration = Duration::from_millis(2);

/// A folder for run directories, logs and working directories.
pub(super) struct Ground {
    folder: TempDir,
    /// A disk for logs, if they are not in the folder.
    logs: Option<&'static Path>,
    /// Library that moves the clock and slows the disk of all programs.
    shim: Option<Shim>,
    network: &'static str,
}

impl Ground {
    /// A folder in memory.
    pub(super) fn new() -> Result<Self, Failure> {
        Self::below(Path::new("/dev/shm"), None)
    }

    /// A folder below this one; `logs` is another disk for logs.
    pub(super) fn below(base: &Path, logs: Option<&'static Path>) -> Result<Self, Failure> {
        let folder = tempfile::Builder::new()
            .prefix("rc-chaos-")
            .tempdir_in(base)?;
        let ground = Self {
            folder,
            logs,
            shim: None,
            network: NETWORK,
        };
        for name in ["run", "state", "work"] {
            std::fs::create_dir(ground.path(name))?;
        }
        let components = root().canonicalize()?.join("components");
        std::fs::write(ground.deployment(), deployment(&components))?;
        Ok(ground)
    }

    /// A folder in memory with the network whose components are threads of one process.
    pub(super) fn in_one() -> Result<Self, Failure> {
        let ground = Self {
            network: IN_ONE,
            ..Self::new()?
        };
        let components = root().canonicalize()?.join("components");
        std::fs::write(ground.deployment(), in_one(&components))?;
        Ok(ground)
    }

    /// Whether the components are threads of one process, so that each kill is one of all.
    pub(super) fn is_one(&self) -> bool {
        self.network == IN_ONE
    }

    /// Gives the programs a clock that can be moved and a disk that can be slowed down, or says why
    /// they have none.
    pub(super) fn add_shim(&mut self) -> Result<(), String> {
        self.shim = Some(Shim::compile(self.folder.path())?);
        Ok(())
    }

    pub(super) fn shim(&self) -> Option<&Shim> {
        self.shim.as_ref()
    }

    /// A file or a folder in this one.
    pub(super) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// The description of the network for rcdeploy.
    pub(super) fn deployment(&self) -> PathBuf {
        self.path("work/chaos.ddsl")
    }

    /// A command for a program of this workspace, in this folder.
    pub(super) fn command(&self, program: &str) -> Result<Command, Failure> {
        let log = File::options()
            .create(true)
            .append(true)
            .open(self.path(&format!("{program}.log")))?;
        let state = self.logs.map_or_else(|| self.path("state"), Path::to_owned);
        let mut command = Command::new(target()?.join("debug").join(program));
        command
            .current_dir(self.path("work"))
            .env("CARGO_TARGET_DIR", target()?)
            .env("XDG_RUNTIME_DIR", self.path("run"))
            .env("XDG_STATE_HOME", state)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(log);
        if let Some(shim) = &self.shim {
            shim.load_into(&mut command);
        }
        Ok(command)
    }

    /// The end of a program's output on stderr.
    pub(super) fn log_end(&self, program: &str) -> String {
        let log = std::fs::read(self.path(&format!("{program}.log"))).unwrap_or_default();
        let end = log.len().saturating_sub(LOG_END);
        String::from_utf8_lossy(&log[end..]).into_owned()
    }

    fn directory(&self) -> RunDirectory {
        RunDirectory::below(&self.path("run/robocomp"), self.network)
    }

    /// Requests the status over `NAME.sock`.
    pub(super) fn status(&self, name: &str) -> Result<Value, Failure> {
        self.call(name, &component::Request::Status)
    }

    /// A request over `NAME.sock`.
    pub(super) fn call(&self, name: &str, request: &component::Request) -> Result<Value, Failure> {
        let mut client = Client::connect(&self.directory().socket(name), ANSWER)?;
        Ok(client.call(request, ANSWER)?)
    }

    /// Whether a component reports that it runs.
    pub(super) fn is_ready(&self, name: &str) -> bool {
        self.status(name)
            .is_ok_and(|status| status["state"] == "running")
    }

    /// Waits until calls are answered and samples arrive: the counters of all three components
    /// increase.
    pub(super) fn works(&self) -> Result<(), Failure> {
        let end = Instant::now() + RECOVERY;
        let mut before = Vec::new();
        loop {
            let now = self.counters().unwrap_or_default();
            if is_more(&before, &now) {
                return Ok(());
            }
            // A restarted component counts from zero.
            if !same_processes(&before, &now) {
                before = now;
            }
            if Instant::now() > end {
                return Err(self.what_hangs().into());
            }
            std::thread::sleep(LOOK * 5);
        }
    }

    /// For each component: its process, and how often it did its work without an error.
    fn counters(&self) -> Result<Vec<(u64, u64)>, Failure> {
        let mut counters = Vec::new();
        for name in NAMES {
            let status = self.status(name)?;
            let counts = match name {
                "simulator" => slot(&status, "Laser"),
                "monitor" => slot(&status, "FullPoseEstimationPub"),
                _ => &status["compute"],
            };
            let [count, errors] =
                ["count", "errors"].map(|word| counts[word].as_u64().unwrap_or(0));
            counters.push((status["pid"].as_u64().unwrap_or(0), count - errors));
        }
        Ok(counters)
    }

    fn what_hangs(&self) -> String {
        let mut text = format!("not at work within {RECOVERY:?}:");
        for name in NAMES {
            text += &match self.status(name) {
                Ok(status) => format!("\n{name}: {status}"),
                Err(error) => format!("\n{name}: {error}"),
            };
        }
        text
    }

    /// Kills one process of this folder, even if its pid now belongs to another one; returns
    /// whether there was one.
    pub(super) fn kill(&self, pid: i32) -> bool {
        let Some(pid) = Pid::from_raw(pid) else {
            return false;
        };
        let Ok(process) = pidfd_open(pid, PidfdFlags::empty()) else {
            return false;
        };
        self.is_ours(&format!("/proc/{}", pid.as_raw_nonzero()))
            && pidfd_send_signal(&process, Signal::KILL).is_ok()
    }

    fn is_ours(&self, process: &str) -> bool {
        let environment = std::fs::read(format!("{process}/environ")).unwrap_or_default();
        let mark = format!("XDG_RUNTIME_DIR={}", self.path("run").display());
        environment
            .split(|byte| *byte == 0)
            .any(|one| one == mark.as_bytes())
    }

    /// Waits until there is no process, no shared memory and no run directory; the error lists what
    /// is left.
    pub(super) fn nothing_is_left(&self) -> Result<(), Failure> {
        let end = Instant::now() + END;
        loop {
            let left = self.left()?;
            if left.is_empty() {
                return Ok(());
            }
            if Instant::now() > end {
                return Err(format!("left behind: {}", left.join(", ")).into());
            }
            std::thread::sleep(LOOK);
        }
    }

    /// Processes, shared memory and files that are left of this folder.
    fn left(&self) -> Result<Vec<String>, Failure> {
        let mut left = Vec::new();
        for entry in std::fs::read_dir("/proc")?.flatten() {
            let process = entry.path().display().to_string();
            if self.is_ours(&process) {
                let name = std::fs::read_to_string(format!("{process}/comm")).unwrap_or_default();
                left.push(format!("process {process} ({})", name.trim()));
            }
        }
        let directory = self.directory();
        let files = rc_iceoryx2::leftovers(&directory);
        left.extend(files.iter().map(|path| path.display().to_string()));
        left.extend(everything_in(&self.path("run/robocomp")));
        Ok(left)
    }

    /// Keeps the folder, and returns its path. Logs on another disk end with this process, so they
    /// are copied.
    pub(super) fn keep(self) -> PathBuf {
        if let Some(logs) = self.logs {
            let state = self.path("state");
            let copy = Command::new("cp").arg("-r").arg(logs).arg(state).status();
            if !copy.is_ok_and(|status| status.success()) {
                eprintln!("xtask: the logs could not be copied");
            }
        }
        self.folder.keep()
    }
}

fn everything_in(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    entries
        .flat_map(|entry| {
            let inside = everything_in(&entry.path());
            std::iter::once(entry.path().display().to_string()).chain(inside)
        })
        .collect()
}

fn slot<'s>(status: &'s Value, name: &str) -> &'s Value {
    let slots = status["slots"].as_array().map_or(&[][..], Vec::as_slice);
    let found = slots.iter().find(|slot| slot["name"] == name);
    found.map_or(&Value::Null, |slot| &slot["handlers"])
}

fn same_processes(before: &[(u64, u64)], now: &[(u64, u64)]) -> bool {
    before.iter().map(|b| b.0).eq(now.iter().map(|n| n.0))
}

fn is_more(before: &[(u64, u64)], now: &[(u64, u64)]) -> bool {
    !now.is_empty() && same_processes(before, now) && before.iter().zip(now).all(|(b, n)| n.1 > b.1)
}

fn deployment(components: &Path) -> String {
    let mut text = Text::new(components);
    for (name, program) in NAMES.iter().zip(PROGRAMS) {
        text.component(name, program, "");
    }
    for (user, provider) in BINDS {
        text.bind(user, provider);
    }
    text.end()
}

/// The connections between the components.
const BINDS: [(&str, &str); 3] = [
    ("avoider.Laser", "simulator.Laser"),
    ("avoider.DifferentialRobot", "simulator.DifferentialRobot"),
    (
        "monitor.FullPoseEstimationPub",
        "simulator.FullPoseEstimationPub",
    ),
];

/// These components as threads of one process, which restarts at once, with a source of time.
fn in_one(components: &Path) -> String {
    let names = NAMES.iter().zip(PROGRAMS).chain([(&CLOCK, CLOCK)]);
    let components = names.map(|(name, program)| {
        let cdsl = components.join(program).join(program);
        let cdsl = cdsl.display();
        format!("        Component {name} {{ cdsl \"{cdsl}.cdsl\"; ready {READY}; }};\n")
    });
    let binds = BINDS.iter();
    let binds = binds.map(|(user, provider)| format!("    bind {user} -> {provider};\n"));
    format!(
        "Deployment {IN_ONE}\n{{\n    middleware auto;\n    time simulated by {CLOCK};\n    Process robot\n    {{\n        \
         restart on_failure backoff 1ms;\n{}    }};\n{}}};\n",
        components.collect::<String>(),
        binds.collect::<String>()
    )
}

/// The `.ddsl` of a network whose components restart at once.
pub(super) struct Text<'c> {
    components: &'c Path,
    text: String,
}

impl<'c> Text<'c> {
    pub(super) fn new(components: &'c Path) -> Self {
        let text = format!("Deployment {NETWORK}\n{{\n    middleware iceoryx2;\n");
        Self { components, text }
    }

    /// A declaration of the network.
    pub(super) fn declare(&mut self, text: &str) {
        self.text += &format!("    {text}\n");
    }

    /// A component of this repository, with `more` fields.
    pub(super) fn component(&mut self, name: &str, program: &str, more: &str) {
        self.component_of(&self.components.join(program), name, program, more);
    }

    /// The component in this folder, with `more` fields.
    pub(super) fn component_of(&mut self, folder: &Path, name: &str, program: &str, more: &str) {
        let path = folder.join(program);
        self.text += &format!(
            "    Component {name}\n    {{\n        cdsl \"{}.cdsl\";\n        ready {READY};\n        restart on_failure backoff 1ms;\n{more}    }};\n",
            path.display()
        );
    }

    pub(super) fn bind(&mut self, user: &str, provider: &str) {
        self.text += &format!("    bind {user} -> {provider};\n");
    }

    pub(super) fn end(self) -> String {
        self.text + "};\n"
    }
}
