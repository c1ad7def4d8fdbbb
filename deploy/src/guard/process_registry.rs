//! Persistent process registry, from which the next `up` kills orphans.

use crate::guard::lock::Lock;
use crate::process::identity::{self, Identity, Mark, first_readable, kill_group};
use rc_deploy_client::connection::KILL_LIMIT;
use rc_deploy_client::error::{Error, ErrorContext};
use rc_middleware::RunDirectory;
use rustix::process::{Pid, Signal};
use serde::{Deserialize, Serialize};
use std::io;
use std::os::fd::OwnedFd;
use std::path::Path;
use std::time::{Duration, Instant};

const NAME: &str = "components.json";
const UNFINISHED: &str = "components.json.new";

/// How long components may take to end by themselves after their supervisor has ended.
const END_LIMIT: Duration = Duration::from_secs(3);

/// The processes of one network.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ProcessRegistry {
    /// The boot id of the system: the pids are valid within one boot only.
    pub boot: String,
    /// The mark of the processes of this network.
    pub mark: Mark,
    /// The components that run.
    pub components: Vec<RegisteredProcess>,
}

/// One component that runs.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct RegisteredProcess {
    /// Name of the component in the network.
    pub name: String,
    /// Process, the leader of its group.
    pub process: Identity,
    /// How long it may take to end, in milliseconds.
    pub stop_ms: u64,
}

/// Result of [`recover`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Recovered {
    /// The network was stopped properly, or was never up.
    Nothing,
    /// Its supervisor and its guard were killed. This many processes were still running.
    Killed(usize),
}

impl ProcessRegistry {
    /// An empty registry.
    pub(crate) fn new(mark: Mark) -> Self {
        Self {
            boot: identity::boot_id(),
            mark,
            components: Vec::new(),
        }
    }

    /// Writes the file atomically.
    pub(crate) fn write(&self, directory: &RunDirectory) -> io::Result<()> {
        let path = directory.path().join(NAME);
        let new = directory.path().join(UNFINISHED);
        std::fs::write(&new, serde_json::to_vec(self)?)?;
        std::fs::rename(&new, &path)
    }

    /// Reads the file. A damaged or unfinished file counts as an empty registry, so that the
    /// directory is cleaned up all the same.
    fn read(directory: &Path) -> Option<Self> {
        let empty = Self {
            boot: String::new(),
            mark: Mark::none(),
            components: Vec::new(),
        };
        match std::fs::read(directory.join(NAME)) {
            Ok(text) => Some(serde_json::from_slice(&text).unwrap_or(empty)),
            Err(_) => directory.join(UNFINISHED).exists().then_some(empty),
        }
    }

    /// Waits for the processes to end, with a limit, and kills the rest. Returns how many were
    /// killed.
    pub(crate) fn end_all(&self) -> usize {
        if self.boot != identity::boot_id() {
            return 0;
        }
        let limit = self.components.iter().map(|c| c.stop_ms).max();
        let limit = Duration::from_millis(limit.unwrap_or(0)).min(END_LIMIT);
        let mut left: Vec<(Pid, OwnedFd)> = self
            .components
            .iter()
            .filter_map(|c| Some((Pid::from_raw(c.process.pid)?, c.process.open()?)))
            .collect();
        wait_and_kill_groups(&mut left, limit);
        let mut killed = left.len();
        for (pid, descriptor) in &left {
            kill_group(*pid);
            identity::signal(descriptor, Signal::KILL);
        }
        wait_and_kill_groups(&mut left, KILL_LIMIT);
        killed += self.mark.sweep();
        killed
    }
}

/// Waits for the leaders of groups. The rest of a group is killed when its leader has ended.
fn wait_and_kill_groups(left: &mut Vec<(Pid, OwnedFd)>, limit: Duration) {
    let deadline = Instant::now() + limit;
    while !left.is_empty() {
        let time = deadline.saturating_duration_since(Instant::now());
        let Some(ended) = first_readable(left.iter().map(|(_, fd)| fd), time) else {
            return;
        };
        let mut ended = ended.into_iter();
        left.retain(|(pid, _)| {
            let ended = ended.next().unwrap_or(false);
            if ended {
                kill_group(*pid);
            }
            !ended
        });
    }
}

/// Kills the processes of a network whose supervisor and guard were both killed, and removes its
/// run directory.
///
/// `cleanup` removes what the middleware has left. Fails if the network is up.
pub fn recover(directory: &RunDirectory, cleanup: &dyn Fn()) -> Result<Recovered, Error> {
    if !directory.path().is_dir() {
        return Ok(Recovered::Nothing);
    }
    let name = directory.path().file_name().unwrap_or_default();
    let lock = Lock::acquire(&name.to_string_lossy())?;
    let found = recover_locked(&lock, cleanup)?;
    // A supervisor that was killed at its very beginning leaves nothing but its lock.
    if found != Recovered::Nothing || lock.is_alone() {
        lock.remove_directory()
            .context(format!("remove {}", directory.path().display()))?;
    }
    Ok(found)
}

/// The same for the holder of the lock, which keeps the directory.
pub(crate) fn recover_locked(lock: &Lock, cleanup: &dyn Fn()) -> Result<Recovered, Error> {
    let directory = lock.directory().path();
    let Some(registry) = ProcessRegistry::read(directory) else {
        return Ok(Recovered::Nothing);
    };
    let killed = registry.end_all();
    cleanup();
    lock.empty_directory()
        .context(format!("empty {}", directory.display()))?;
    Ok(Recovered::Killed(killed))
}
