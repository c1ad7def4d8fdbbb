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
    /// directory is cleaned up nevertheless.
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
/// `cleanup` removes the remains of the middleware. Fails if the network is up.
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

/// Recovers for the holder of the lock, which keeps the directory.
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

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::process::CommandExt;
    use std::process::{Child, Command, Stdio};

    /// A process that leads a group.
    fn sleep() -> (Child, RegisteredProcess) {
        let mut sleep = Command::new("sleep");
        let child = sleep.arg("600").process_group(0).stdout(Stdio::null());
        let child = child.spawn().expect("it starts");
        let pid = child.id().try_into().expect("a pid");
        let process = RegisteredProcess {
            name: "a".to_owned(),
            process: Identity::of(pid).expect("it runs"),
            stop_ms: 20,
        };
        (child, process)
    }

    fn registry(components: Vec<RegisteredProcess>) -> ProcessRegistry {
        ProcessRegistry {
            components,
            ..ProcessRegistry::new(Mark::none())
        }
    }

    #[test]
    fn a_registry_is_read_as_it_was_written() {
        let folder = tempfile::tempdir().expect("a folder");
        let directory = RunDirectory::below(folder.path(), "net");
        std::fs::create_dir_all(directory.path()).expect("a folder");
        let read = || ProcessRegistry::read(directory.path());
        assert_eq!(read(), None);
        let unfinished = directory.path().join(UNFINISHED);
        std::fs::write(&unfinished, "{").expect("written");
        let damaged = read().expect("an empty one");
        assert!(damaged.components.is_empty() && damaged.boot.is_empty());
        let (mut child, process) = sleep();
        let written = registry(vec![process]);
        written.write(&directory).expect("written");
        assert_eq!(read(), Some(written));
        assert!(!unfinished.exists());
        std::fs::write(directory.path().join(NAME), "{").expect("written");
        assert_eq!(read(), Some(damaged));
        child.kill().expect("it runs");
        child.wait().expect("it has ended");
    }

    #[test]
    fn processes_that_are_left_are_killed_within_their_boot() {
        let (mut first, a) = sleep();
        let (mut second, b) = sleep();
        let other = ProcessRegistry {
            boot: "another".to_owned(),
            ..registry(vec![a.clone()])
        };
        assert_eq!(other.end_all(), 0);
        assert!(first.try_wait().expect("a child").is_none());
        assert_eq!(registry(vec![a, b]).end_all(), 2);
        for child in [&mut first, &mut second] {
            assert!(!child.wait().expect("it has ended").success());
        }
        assert_eq!(registry(Vec::new()).end_all(), 0);
    }

    #[test]
    fn the_group_of_a_leader_that_has_ended_is_killed() {
        let mut leader = Command::new("sh");
        let leader = leader.args(["-c", "sleep 600 & echo $!; read line"]);
        let leader = leader.process_group(0).stdin(Stdio::piped());
        let mut leader = leader.stdout(Stdio::piped()).spawn().expect("it starts");
        let mut line = String::new();
        let output = leader.stdout.take().expect("a pipe");
        let mut output = std::io::BufReader::new(output);
        std::io::BufRead::read_line(&mut output, &mut line).expect("a number");
        let pid = |text: &str| text.trim().parse().expect("a number");
        let member = Identity::of(pid(&line)).expect("it runs");
        let member = member.open().expect("it runs");
        let group = Pid::from_child(&leader);
        let whole = Identity::of(group.as_raw_nonzero().get()).expect("it runs");
        let mut left = vec![(group, whole.open().expect("it runs"))];
        wait_and_kill_groups(&mut left, Duration::from_millis(1));
        assert_eq!(left.len(), 1, "it runs");
        drop(leader.stdin.take());
        wait_and_kill_groups(&mut left, Duration::from_mins(1));
        assert!(left.is_empty());
        assert!(first_readable([&member], Duration::from_mins(1)).is_some());
        leader.wait().expect("it has ended");
    }
}
