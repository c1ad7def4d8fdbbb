//! Processes that this one has adopted: children of components that left their session and removed
//! the environment by which orphans are found.
//!
//! As a child subreaper (prctl(2)), this process becomes the parent of each descendant whose own
//! parent ends. So the end of the network reaches all of them, and not only those with its mark.

use crate::process::identity::{self, Identity, first_readable};
use rustix::process::{Pid, Signal, WaitOptions, set_child_subreaper, waitpid};
use std::collections::BTreeSet;
use std::time::Duration;

/// How often the end looks for children of processes that were killed.
const ROUNDS: usize = 10;
/// How long it waits for each of them.
const KILL_LIMIT: Duration = Duration::from_millis(500);

/// The adopted processes of this one.
#[derive(Debug)]
pub(crate) struct AdoptedProcesses {
    /// The children from before: this process may have taken the place of another program.
    earlier: BTreeSet<i32>,
    known: Vec<Identity>,
}

impl AdoptedProcesses {
    /// Adopts from now on. `None` if the system does not allow that, or does not list children.
    pub(crate) fn begin() -> Option<Self> {
        let earlier = children()?;
        set_child_subreaper(Pid::from_raw(1)).ok()?;
        Some(Self {
            earlier,
            known: Vec::new(),
        })
    }

    /// Looks for adopted processes; `own` are the children that this process has started. Returns
    /// those that are new, and those that have ended.
    pub(crate) fn look(&mut self, own: &BTreeSet<i32>) -> (Vec<Identity>, Vec<Identity>) {
        let living = self.living(own);
        let new = living.iter().filter(|one| !self.known.contains(one));
        let ended = self.known.iter().filter(|one| !living.contains(one));
        let changes = (new.copied().collect(), ended.copied().collect());
        self.known = living;
        changes
    }

    /// Kills all adopted processes. Returns their number.
    pub(crate) fn kill(&mut self, own: &BTreeSet<i32>) -> usize {
        let mut killed = BTreeSet::new();
        // The children of a process that is killed are adopted then.
        for _ in 0..ROUNDS {
            let living = self.living(own);
            if living.is_empty() {
                break;
            }
            for process in living {
                let Some(descriptor) = process.open() else {
                    continue;
                };
                identity::signal(&descriptor, Signal::KILL);
                first_readable([&descriptor], KILL_LIMIT);
                killed.insert(process.pid);
            }
        }
        killed.len()
    }

    /// The adopted processes that live. Those that have ended are reaped.
    fn living(&self, own: &BTreeSet<i32>) -> Vec<Identity> {
        let children = children().unwrap_or_default();
        let adopted = children.difference(own);
        let adopted = adopted.filter(|pid| !self.earlier.contains(pid));
        let living = adopted.filter_map(|&pid| {
            let living = Identity::of(pid);
            if living.is_none() {
                // Nobody else waits for it.
                let _ = waitpid(Pid::from_raw(pid), WaitOptions::NOHANG);
            }
            living
        });
        living.collect()
    }
}

/// The children of this process: `proc_tid_children(5)`.
fn children() -> Option<BTreeSet<i32>> {
    let mut children = BTreeSet::new();
    for task in std::fs::read_dir("/proc/self/task").ok()?.flatten() {
        // A thread may have ended in the meantime.
        let text = std::fs::read_to_string(task.path().join("children"));
        match text {
            Ok(text) => {
                let pids = text.split_ascii_whitespace();
                children.extend(pids.flat_map(str::parse::<i32>));
            }
            Err(_) if !task.path().exists() => {}
            // The system has no such list.
            Err(_) => return None,
        }
    }
    Some(children)
}
