//! Processes of the kernel: identity, life, signals, and the mark of a network.

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::process::{Pid, PidfdFlags, Signal, kill_process_group, pidfd_open, pidfd_send_signal};
use serde::{Deserialize, Serialize};
use std::os::fd::{AsFd, OwnedFd};
use std::time::{Duration, Instant};

/// The environment variable with the [`Mark`] of the network. Every process of a network inherits
/// it.
pub const MARK: &str = "RC_SUPERVISOR";

/// The environment variable with the name of the component and the number of its run. Child
/// processes inherit it.
pub const COMPONENT: &str = "RC_COMPONENT";

/// Identifies a process, even after the system has reused its pid.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Identity {
    /// The pid.
    pub pid: i32,
    /// Start time in clock ticks since the start of the system: `starttime` of proc(5).
    pub starttime: u64,
}

impl Identity {
    /// The process with this pid. A zombie is none.
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

    /// Whether it is stopped, by a signal or a debugger.
    pub fn is_stopped(&self) -> bool {
        let stat = std::fs::read_to_string(format!("/proc/{}/stat", self.pid)).unwrap_or_default();
        let state = stat
            .rsplit_once(')')
            .and_then(|(_, rest)| rest.split_ascii_whitespace().next());
        starttime(&stat) == Some(self.starttime) && matches!(state, Some("T" | "t"))
    }

    /// A pidfd of this process, if it still runs. It becomes readable when the process ends.
    pub fn open(&self) -> Option<OwnedFd> {
        let descriptor = pidfd_open(Pid::from_raw(self.pid)?, PidfdFlags::empty()).ok()?;
        // Checked afterwards, because the pid may have been reused before the pidfd was opened.
        self.is_alive().then_some(descriptor)
    }
}

pub(super) fn starttime(stat: &str) -> Option<u64> {
    // The program name is in parentheses and may contain any character.
    let (_, rest) = stat.rsplit_once(')')?;
    let mut fields = rest.split_ascii_whitespace();
    let state = fields.next()?;
    if matches!(state, "Z" | "X") {
        return None;
    }
    fields.nth(18)?.parse().ok()
}

/// The boot id of the system. Pids and start times are valid within one boot only.
pub(crate) fn boot_id() -> String {
    std::fs::read_to_string("/proc/sys/kernel/random/boot_id")
        .map(|text| text.trim().to_owned())
        .unwrap_or_default()
}

/// Sends SIGKILL to the process group of `leader`. The caller knows that the leader runs, or is not
/// reaped yet.
pub(crate) fn kill_group(leader: Pid) {
    // The group may be empty. Nothing else can fail for own processes.
    let _ = kill_process_group(leader, Signal::KILL);
}

/// Sends a signal to the process of a pidfd. A process that has ended is not an error.
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

/// Marks the processes of one run of a network: the network, the pid of its supervisor, and when
/// that started.
///
/// A process that leaves the process group of its component keeps the mark in its environment, and
/// one that removes its environment keeps its [`Tag`](crate::process::tag::Tag).
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

    /// A mark of no process.
    pub(crate) fn none() -> Self {
        Self(String::new())
    }

    /// The value of [`MARK`].
    pub fn value(&self) -> &str {
        &self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::process::Command;

    #[test]
    fn the_name_of_a_program_does_not_confuse_its_start_time() {
        let stat = "7 (a) Z (b) S 1 7 7 0 -1 4194560 1 0 0 0 1 2 0 0 20 0 1 0 4711 10 20";
        assert_eq!(starttime(stat), Some(4711));
        assert_eq!(starttime(&stat.replace(") S", ") Z")), None);
    }

    #[test]
    fn a_reused_pid_is_another_process() {
        let own = Identity::own().expect("this process runs");
        assert!(own.is_alive() && own.open().is_some());
        let other = Identity {
            starttime: own.starttime + 1,
            ..own
        };
        assert!(!other.is_alive() && other.open().is_none());
    }

    #[test]
    fn a_group_is_killed_with_all_its_members() {
        use std::io::{BufRead, BufReader};
        use std::os::unix::process::CommandExt;
        let mut leader = Command::new("sh")
            .args(["-c", "sleep 600 & echo $!; wait"])
            .process_group(0)
            .stdout(std::process::Stdio::piped())
            .spawn()
            .expect("it starts");
        let mut line = String::new();
        let output = leader.stdout.take().expect("a pipe");
        let mut output = BufReader::new(output);
        output.read_line(&mut line).expect("a number");
        let member = Identity::of(line.trim().parse().expect("a number")).expect("it runs");
        let process = member.open().expect("it runs");
        kill_group(Pid::from_child(&leader));
        let status = leader.wait().expect("it has ended");
        assert!(!status.success());
        assert!(first_readable([&process], Duration::from_secs(10)).is_some());
    }
}
