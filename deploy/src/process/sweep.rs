//! Kills the processes of a network that are left: those with its mark.

use crate::process::identity::{COMPONENT, Identity, MARK, Mark, first_readable, starttime};
use crate::process::tag::Tag;
use rustix::process::{Pid, PidfdFlags, Signal, pidfd_open, pidfd_send_signal};
use rustix::time::{ClockId, clock_gettime};
use std::collections::HashMap;
use std::io::Read;
use std::os::fd::OwnedFd;
use std::time::{Duration, Instant};

/// How long a sweep waits in total for processes between `fork` and `execve`, and how often it
/// checks them.
const EXEC_LIMIT: Duration = Duration::from_millis(200);
const EXEC_PAUSE: Duration = Duration::from_millis(2);

impl Mark {
    /// Kills every process with this mark. Returns how many there were.
    pub fn sweep(&self) -> usize {
        self.sweep_those(None).len()
    }

    /// Kills the processes that these runs of components have left. Returns how many there were of
    /// each.
    pub(crate) fn sweep_of(&self, runs: &[String]) -> Vec<usize> {
        let mut killed = vec![0; runs.len()];
        for at in self.sweep_those(Some(runs)) {
            killed[at] += 1;
        }
        killed
    }

    /// Kills the processes with this mark, with `runs` only those of these runs. Returns for each
    /// of them the index of its run.
    fn sweep_those(&self, runs: Option<&[String]>) -> Vec<usize> {
        let mut killed = Vec::new();
        if *self == Self::none() {
            return killed;
        }
        let wanted = ProcessMarks::new(self, runs);
        let mut patience = EXEC_LIMIT;
        // A process may have forked during the search.
        for _ in 0..5 {
            let mut found = bearers(&wanted);
            while found.is_none() && !patience.is_zero() {
                patience = patience.saturating_sub(EXEC_PAUSE);
                std::thread::sleep(EXEC_PAUSE);
                found = bearers(&wanted);
            }
            let Some(found) = found else { break };
            if found.is_empty() {
                break;
            }
            for (process, run) in &found {
                // A process of another user stays.
                if pidfd_send_signal(process, Signal::KILL).is_ok() {
                    killed.push(*run);
                }
            }
            let deadline = Instant::now() + Duration::from_millis(500);
            for (process, _) in &found {
                let left = deadline.saturating_duration_since(Instant::now());
                first_readable([process], left);
            }
        }
        killed
    }
}

/// The criteria by which processes are found.
struct ProcessMarks {
    /// The entry of the environment.
    entry: String,
    mark: Mark,
    /// The runs that are wanted; `None`: any.
    runs: Option<Runs>,
}

/// The index of each run, by its entry of the environment and by its tag.
struct Runs {
    entries: HashMap<String, usize>,
    tags: HashMap<Tag, usize>,
}

impl ProcessMarks {
    fn new(mark: &Mark, runs: Option<&[String]>) -> Self {
        let index = |runs: &[String]| {
            let entry = |(at, run): (usize, &String)| (format!("{COMPONENT}={run}"), at);
            let tag = |(at, run): (usize, &String)| Some((Tag::of(mark, run)?, at));
            Runs {
                entries: runs.iter().enumerate().map(entry).collect(),
                tags: runs.iter().enumerate().filter_map(tag).collect(),
            }
        };
        Self {
            entry: format!("{MARK}={}", mark.value()),
            mark: mark.clone(),
            runs: runs.map(index),
        }
    }

    /// The index of the run to which a process with this environment and this tag belongs. The tag
    /// decides where the environment does not name a run.
    fn run_of(&self, environment: &[u8], tag: Option<Tag>) -> Option<usize> {
        let entries = || environment.split(|&byte| byte == 0);
        let is_marked = entries().any(|entry| entry == self.entry.as_bytes());
        let Some(runs) = &self.runs else {
            let is_tagged = tag.is_some_and(|tag| tag.is_of(&self.mark));
            return (is_marked || is_tagged).then_some(0);
        };
        let start = format!("{COMPONENT}=");
        match entries().find(|entry| entry.starts_with(start.as_bytes())) {
            Some(run) if is_marked => runs.entries.get(std::str::from_utf8(run).ok()?).copied(),
            _ => runs.tags.get(&tag?).copied(),
        }
    }
}

/// The processes that are wanted, with the index of their run. `None` if there are none, but a
/// process between `fork` and `execve` may become one.
fn bearers(wanted: &ProcessMarks) -> Option<Vec<(OwnedFd, usize)>> {
    let own = std::process::id();
    let program = std::fs::read_link("/proc/self/exe").ok();
    let mut unsettled = false;
    let mut found = Vec::new();
    for entry in std::fs::read_dir("/proc").into_iter().flatten().flatten() {
        let pid = entry
            .file_name()
            .to_str()
            .and_then(|name| name.parse().ok());
        let Some(pid) = pid.filter(|&pid: &i32| u32::try_from(pid) != Ok(own)) else {
            continue;
        };
        let Some(process) = Pid::from_raw(pid) else {
            continue;
        };
        let Ok(descriptor) = pidfd_open(process, PidfdFlags::empty()) else {
            continue;
        };
        // Read before the environment: a process that has executed another program has its own.
        let is_copy =
            program.is_some() && program == std::fs::read_link(format!("/proc/{pid}/exe")).ok();
        let mut seen = environment(pid);
        if seen.as_ref().is_some_and(Vec::is_empty) {
            match has_environment(pid) {
                Some(false) => unsettled = true,
                // It has executed its program in the meantime.
                Some(true) => seen = environment(pid),
                None => {}
            }
        }
        let tag = Tag::of_process(pid);
        // It has ended, or belongs to another user.
        if seen.is_none() && tag.is_none() {
            continue;
        }
        match wanted.run_of(&seen.unwrap_or_default(), tag) {
            None => unsettled |= is_copy && is_before_exec(pid),
            Some(run) if Identity::of(pid).is_some() => found.push((descriptor, run)),
            Some(_) => {}
        }
    }
    (!found.is_empty() || !unsettled).then_some(found)
}

/// The initial environment of a process. `None` if it has ended, or belongs to another user.
fn environment(pid: i32) -> Option<Vec<u8>> {
    let mut environment = Vec::new();
    let file = std::fs::File::open(format!("/proc/{pid}/environ")).ok()?;
    file.take(4 << 20).read_to_end(&mut environment).ok()?;
    Some(environment)
}

/// Whether a process is a copy of this program that has not executed its own program yet. Until
/// `execve`, it has the environment and the command line of its parent, which may continue, or be
/// killed, in the meantime.
fn is_before_exec(pid: i32) -> bool {
    let line = |pid: i32| std::fs::read(format!("/proc/{pid}/cmdline")).ok();
    let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).unwrap_or_default();
    let parent = stat.rsplit_once(')').and_then(|(_, rest)| {
        let mut fields = rest.split_ascii_whitespace();
        fields.nth(1)?.parse().ok()
    });
    let is_alike = parent.is_some_and(|parent| parent == 1 || line(parent) == line(pid));
    is_alike && starttime(&stat).is_some_and(is_young)
}

/// Whether this start time is less than a second ago.
fn is_young(starttime: u64) -> bool {
    let second = rustix::param::clock_ticks_per_second();
    let now = clock_gettime(ClockId::Boottime);
    let (seconds, nanoseconds) = (now.tv_sec.unsigned_abs(), now.tv_nsec.unsigned_abs());
    let now = seconds * second + nanoseconds * second / 1_000_000_000;
    now.saturating_sub(starttime) < second
}

/// Whether a process has an environment yet, see [`knows_environment`].
fn has_environment(pid: i32) -> Option<bool> {
    let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
    knows_environment(&stat)
}

/// Whether `env_end` is set in this `stat` of proc(5). `None` for a process that never has an
/// environment. `execve` replaces the memory before it sets the position of the environment, and
/// the parent may continue in between.
fn knows_environment(stat: &str) -> Option<bool> {
    /// `PF_KTHREAD` of the kernel's `sched.h`. Kernel threads have no environment.
    const KERNEL: u64 = 0x0020_0000;
    let (_, rest) = stat.rsplit_once(')')?;
    let mut fields = rest.split_ascii_whitespace();
    let state = fields.next()?;
    let flags: u64 = fields.nth(5)?.parse().ok()?;
    let end = fields.nth(41)?;
    (!matches!(state, "Z" | "X") && flags & KERNEL == 0).then_some(end != "0")
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::process::Command;

    #[test]
    fn only_a_running_program_can_be_between_fork_and_exec() {
        let stat = |flags: u64, end: u64| {
            let middle = "0 ".repeat(41);
            format!("7 (a) S 1 7 7 0 -1 {flags} {middle}{end} 0")
        };
        assert_eq!(knows_environment(&stat(0x40_0000, 0)), Some(false));
        assert_eq!(knows_environment(&stat(0x40_0000, 4711)), Some(true));
        assert_eq!(knows_environment(&stat(0x20_8040, 0)), None);
        let ended = stat(0x40_0000, 0).replace(") S", ") Z");
        assert_eq!(knows_environment(&ended), None);
    }

    #[test]
    fn the_environment_decides_before_the_tag() {
        let mark = Mark::new("marks-test", Identity::own().expect("this process runs"));
        let other = Mark::new("others", Identity::own().expect("this process runs"));
        let runs = ["a/1".to_owned(), "b/1".to_owned()];
        let (all, some) = (
            ProcessMarks::new(&mark, None),
            ProcessMarks::new(&mark, Some(&runs)),
        );
        let marked = |run: &str| format!("X=1\0{MARK}={}\0{COMPONENT}={run}\0", mark.value());
        let tag = |run: &str| Tag::of(&mark, run);
        for (environment, tag, whole, part) in [
            (marked("b/1"), None, Some(0), Some(1)),
            (marked("b/1"), tag("a/1"), Some(0), Some(1)),
            (marked("c/1"), tag("a/1"), Some(0), None),
            (String::new(), tag("b/1"), Some(0), Some(1)),
            (String::new(), tag("c/1"), Some(0), None),
            (
                format!("{MARK}={}\0", mark.value()),
                tag("b/1"),
                Some(0),
                Some(1),
            ),
            (format!("{COMPONENT}=b/1\0"), None, None, None),
            (String::new(), Tag::of(&other, "b/1"), None, None),
            (String::new(), None, None, None),
        ] {
            assert_eq!(
                all.run_of(environment.as_bytes(), tag),
                whole,
                "{environment}"
            );
            assert_eq!(
                some.run_of(environment.as_bytes(), tag),
                part,
                "{environment}"
            );
        }
    }

    #[test]
    fn a_sweep_finds_processes_of_its_network_only() {
        let own = Identity::own().expect("this process runs");
        let mark = Mark::new("sweep-test", own);
        let spawn = |value: &str| {
            Command::new("sleep")
                .arg("60")
                .env(MARK, value)
                .spawn()
                .expect("sleep starts")
        };
        let mut other = spawn("sweep-test/0/0");
        // Each is looked for at once, while it may still be on its way into its program.
        for _ in 0..50 {
            let mut ours = spawn(mark.value());
            assert_eq!(mark.sweep(), 1);
            assert!(!ours.wait().expect("it ended").success());
        }
        assert!(other.try_wait().expect("it can be asked").is_none());
        other.kill().expect("it is ours");
        other.wait().expect("it ended");
    }
}
