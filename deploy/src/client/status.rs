//! What `rcdeploy status` shows, as it travels from the supervisor.

use crate::process::realtime;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt;
use std::path::{Path, PathBuf};

/// Where a component is in its life.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum State {
    /// Not started yet, or not yet again: others must be ready first, or a pause must pass.
    Waiting,
    /// It runs, and is not ready yet.
    Starting,
    /// It does its work.
    Running,
    /// It runs, and says that it cannot do its work.
    Emergency,
    /// It was asked to end, or ends by itself.
    Stopping,
    /// It ended with status 0, or because it was asked to.
    Done,
    /// It ended in another way.
    Failed,
    /// It runs, and its loop has not turned for a while.
    Hung,
    /// A command has stopped it, and nobody has started it since.
    Stopped,
}

impl fmt::Display for State {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Waiting => "waiting",
            Self::Starting => "starting",
            Self::Running => "running",
            Self::Emergency => "emergency",
            Self::Stopping => "stopping",
            Self::Done => "done",
            Self::Failed => "failed",
            Self::Hung => "hung",
            Self::Stopped => "stopped",
        })
    }
}

/// A network that is up.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Status {
    /// Its name.
    pub network: String,
    /// Its supervisor.
    pub pid: i32,
    /// The process that cleans up after the supervisor.
    pub guard: Option<i32>,
    /// The file that it was started from.
    pub ddsl: PathBuf,
    /// Of that file as it was then; none where it could not be read.
    #[serde(default)]
    pub digest: Option<String>,
    /// Whether that file is another one by now. Whoever asks looks, not the supervisor.
    #[serde(default)]
    pub changed: bool,
    /// Its components, in the order of their start.
    pub components: Vec<ComponentStatus>,
}

/// One component of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ComponentStatus {
    /// Its name.
    pub name: String,
    /// The machine that it runs on; this one where there is none.
    #[serde(default)]
    pub host: Option<String>,
    /// Where it is in its life.
    pub state: State,
    /// Its process, while it runs.
    pub pid: Option<i32>,
    /// Seconds since its start, while it runs.
    pub uptime_s: Option<f64>,
    /// Whether it has reported ready.
    pub ready: bool,
    /// The middleware that it was generated for.
    pub middleware: String,
    /// The processors that it may run on; any where there is none.
    #[serde(default)]
    pub cpu: Vec<u16>,
    /// Its real-time priority (`SCHED_FIFO`), where it has one.
    #[serde(default)]
    pub priority: Option<u8>,
    /// What is run.
    pub executable: PathBuf,
    /// What it printed.
    pub log: PathBuf,
    /// How often it was started again by itself, without a command.
    pub restarts: u32,
    /// How long it may take from its start until it is ready, in milliseconds.
    pub ready_ms: u64,
    /// How long it may take to end when it is asked to, in milliseconds.
    pub stop_ms: u64,
    /// How many values its slots have lost in this run; slots that lost none are left out.
    #[serde(default)]
    pub lost: BTreeMap<String, u64>,
    /// What is wrong with it now.
    #[serde(default)]
    pub troubles: Vec<Trouble>,
    /// How it ended.
    pub exit: Option<String>,
}

/// Something that has begun and is not over.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Trouble {
    /// The code of the event with which it began.
    pub code: String,
    /// The same for people, as it was seen last.
    pub message: String,
    /// When it began, in UTC.
    pub since: String,
}

/// What tells one content of a file from another; none where it cannot be read.
pub(crate) fn digest(path: &Path) -> Option<String> {
    let text = rc_files::read(path).ok()?;
    Some(format!("{:016x}", rc_idsl::canonical::hash(&text)))
}

impl Status {
    /// Looks whether the file that the network was started from has changed since.
    pub(crate) fn look_at_the_file(&mut self) {
        self.changed = self.digest.is_some() && digest(&self.ddsl) != self.digest;
    }
}

impl fmt::Display for Status {
    /// A table for people.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "network {} from {}, supervised by process {}",
            self.network,
            self.ddsl.display(),
            self.pid
        )?;
        if self.changed {
            writeln!(
                f,
                "{} is not what the network was started from any more; what runs stays as it is until `rcdeploy down` and `up`",
                self.ddsl.display()
            )?;
        }
        let width = self.components.iter().map(|c| c.name.len()).max();
        let width = width.unwrap_or(0).max(9);
        writeln!(
            f,
            "{:width$}  {:9}  {:>8}  {:>9}  {:10}",
            "component", "state", "pid", "up", "middleware"
        )?;
        for component in &self.components {
            let pid = component
                .pid
                .map_or_else(String::new, |pid| pid.to_string());
            let up = component
                .uptime_s
                .map_or_else(String::new, |s| format!("{s:.1} s"));
            write!(
                f,
                "{:width$}  {:9}  {pid:>8}  {up:>9}  {:10}",
                component.name, component.state, component.middleware
            )?;
            if let Some(host) = &component.host {
                write!(f, "  on {host}")?;
            }
            if !component.cpu.is_empty() {
                write!(f, "  cpu {}", realtime::list(&component.cpu))?;
            }
            if let Some(priority) = component.priority {
                write!(f, "  priority {priority}")?;
            }
            if let Some(exit) = &component.exit {
                write!(f, "  {exit}")?;
            }
            match component.restarts {
                0 => {}
                1 => write!(f, "  started again once")?,
                times => write!(f, "  started again {times} times")?,
            }
            for (slot, lost) in &component.lost {
                write!(f, "  {slot} lost {lost}")?;
            }
            writeln!(f)?;
            for trouble in &component.troubles {
                writeln!(f, "{:width$}  {}: {}", "", trouble.code, trouble.message)?;
            }
        }
        Ok(())
    }
}
