//! Processes as the kernel knows them: who they are, whether they live, how they are ended.

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::process::{Pid, PidfdFlags, Signal, kill_process_group, pidfd_open, pidfd_send_signal};
use serde::{Deserialize, Serialize};
use std::io::Read;
use std::os::fd::{AsFd, OwnedFd};
use std::time::{Duration, Instant};

/// The environment variable that every process of a network carries and inherits, see [`Mark`].
pub const MARK: &str = "RC_SUPERVISOR";

/// How long a process that got SIGKILL is waited for. Only one that hangs in the kernel needs longer.
pub(crate) const KILL_LIMIT: Duration = Duration::from_secs(2);

/// A process, also when its pid has been given to another one since.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Identity {
    /// The pid.
    pub pid: i32,
    /// Its start in clock ticks since the system's, `starttime` of proc(5).
    pub starttime: u64,
}

impl Identity {
    /// The process that has this pid now. One that ended, and only waits for its parent, is none.
    pub fn of(pid: i32) -> Option<Self> {
        let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
        let starttime = starttime(&stat)?;
        Some(Self { pid, starttime })
    }

    /// This process itself.
    pub fn own() -> Option<Self> {
        Self::of(std::process::id().try_into().ok()?)
    }

    /// Whether it still runs.
    pub fn is_alive(&self) -> bool {
        Self::of(self.pid) == Some(*self)
    }

    /// A descriptor of this very process, if it still runs. It becomes readable when the process ends.
    pub fn open(&self) -> Option<OwnedFd> {
        let descriptor = pidfd_open(Pid::from_raw(self.pid)?, PidfdFlags::empty()).ok()?;
        // Only now is it certain whom the descriptor means: a pid cannot come back to its first owner.
        self.is_alive().then_some(descriptor)
    }
}

fn starttime(stat: &str) -> Option<u64> {
    // The name of the program comes second, in parentheses, and may contain anything.
    let (_, rest) = stat.rsplit_once(')')?;
    let mut fields = rest.split_ascii_whitespace();
    let state = fields.next()?;
    if matches!(state, "Z" | "X") {
        return None;
    }
    fields.nth(18)?.parse().ok()
}

/// Which run of the system this is; a pid and its time of start mean nothing in another one.
pub(crate) fn boot() -> String {
    std::fs::read_to_string("/proc/sys/kernel/random/boot_id")
        .map(|text| text.trim().to_owned())
        .unwrap_or_default()
}

/// Sends SIGKILL to every process of the group of `leader`, which the caller knows not to be reaped, or to live.
pub(crate) fn kill_group(leader: Pid) {
    // The group may be empty; there is nothing else that could fail for one's own processes.
    let _ = kill_process_group(leader, Signal::KILL);
}

/// Sends a signal to the process behind a descriptor. One that has ended is no error.
pub(crate) fn signal(descriptor: &OwnedFd, signal: Signal) {
    let _ = pidfd_send_signal(descriptor, signal);
}

/// Waits until one of `descriptors` is readable; `None` after `limit`.
pub(crate) fn first_readable<'d>(
    descriptors: impl IntoIterator<Item = &'d OwnedFd>,
    limit: Duration,
) -> Option<Vec<bool>> {
    let deadline = Instant::now() + limit;
    let mut polled: Vec<PollFd<'_>> = descriptors
        .into_iter()
        .map(|fd| PollFd::from_borrowed_fd(fd.as_fd(), PollFlags::IN))
        .collect();
    loop {
        let left = deadline.saturating_duration_since(Instant::now());
        let timeout = Timespec::try_from(left).ok()?;
        match poll(&mut polled, Some(&timeout)) {
            Ok(0) => return None,
            Ok(_) => return Some(polled.iter().map(|fd| !fd.revents().is_empty()).collect()),
            Err(rustix::io::Errno::INTR) => {}
            Err(_) => return None,
        }
    }
}

/// What marks the processes of one run of one network: the network, its supervisor, and when that started.
///
/// Whoever leaves the process group of its component still has it in its environment.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Mark(String);

impl Mark {
    /// The mark of a network that `supervisor` starts.
    pub fn new(network: &str, supervisor: Identity) -> Self {
        Self(format!(
            "{network}/{}/{}",
            supervisor.pid, supervisor.starttime
        ))
    }

    /// The mark that no process carries.
    pub(crate) fn nobody() -> Self {
        Self(String::new())
    }

    /// The value of [`MARK`].
    pub fn value(&self) -> &str {
        &self.0
    }

    /// Kills every process that carries this mark, and returns how many there were.
    pub fn sweep(&self) -> usize {
        if *self == Self::nobody() {
            return 0;
        }
        let mut killed = 0;
        // A process may have forked while the others were looked at.
        for _ in 0..5 {
            let found = self.bearers();
            if found.is_empty() {
                break;
            }
            killed += found.len();
            for process in &found {
                signal(process, Signal::KILL);
            }
            let deadline = Instant::now() + Duration::from_millis(500);
            for process in &found {
                let left = deadline.saturating_duration_since(Instant::now());
                first_readable([process], left);
            }
        }
        killed
    }

    fn bearers(&self) -> Vec<OwnedFd> {
        let wanted = format!("{MARK}={}", self.0);
        let own = std::process::id();
        let entries = std::fs::read_dir("/proc").into_iter().flatten().flatten();
        entries
            .filter_map(|entry| entry.file_name().to_str()?.parse::<i32>().ok())
            .filter(|&pid| u32::try_from(pid) != Ok(own))
            .filter_map(|pid| {
                let descriptor = pidfd_open(Pid::from_raw(pid)?, PidfdFlags::empty()).ok()?;
                let mut environment = Vec::new();
                let file = std::fs::File::open(format!("/proc/{pid}/environ")).ok()?;
                file.take(4 << 20).read_to_end(&mut environment).ok()?;
                let mut entries = environment.split(|&byte| byte == 0);
                let marked = entries.any(|entry| entry == wanted.as_bytes());
                (marked && Identity::of(pid).is_some()).then_some(descriptor)
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::process::Command;

    #[test]
    fn the_name_of_a_program_cannot_hide_its_start() {
        let stat = "7 (a) Z (b) S 1 7 7 0 -1 4194560 1 0 0 0 1 2 0 0 20 0 1 0 4711 10 20";
        assert_eq!(starttime(stat), Some(4711));
        assert_eq!(starttime(&stat.replace(") S", ") Z")), None);
    }

    #[test]
    fn a_process_is_not_another_one_with_its_pid() {
        let own = Identity::own().expect("this process runs");
        assert!(own.is_alive() && own.open().is_some());
        let other = Identity {
            starttime: own.starttime + 1,
            ..own
        };
        assert!(!other.is_alive() && other.open().is_none());
    }

    #[test]
    fn a_sweep_finds_its_own_and_no_others() {
        let own = Identity::own().expect("this process runs");
        let mark = Mark::new("sweep-test", own);
        let spawn = |value: &str| {
            Command::new("sleep")
                .arg("60")
                .env(MARK, value)
                .spawn()
                .expect("sleep starts")
        };
        let (mut ours, mut other) = (spawn(mark.value()), spawn("sweep-test/0/0"));
        assert_eq!(mark.sweep(), 1);
        assert!(!ours.wait().expect("it ended").success());
        assert!(other.try_wait().expect("it can be asked").is_none());
        other.kill().expect("it is ours");
        other.wait().expect("it ended");
    }
}
