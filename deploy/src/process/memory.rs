//! The memory of processes, and when it is read.

use std::time::{Duration, Instant};

/// When to read the memory of processes.
#[derive(Debug)]
pub(crate) struct MemoryRounds {
    pub(crate) pause: Duration,
    due: Instant,
}

impl MemoryRounds {
    pub(crate) fn new(pause: Duration) -> Self {
        Self {
            pause,
            due: Instant::now() + pause,
        }
    }

    pub(crate) fn deadline(&self) -> Instant {
        self.due
    }

    /// Whether it is time.
    pub(crate) fn is_due(&mut self, now: Instant) -> bool {
        let is_due = now >= self.due;
        if is_due {
            self.due = now + self.pause;
        }
        is_due
    }
}

/// The resident memory of a process in bytes: `VmRSS` of `/proc/PID/status`.
pub(crate) fn resident(pid: i32) -> Option<u64> {
    let text = std::fs::read_to_string(format!("/proc/{pid}/status")).ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("VmRSS:"))?;
    let kib: u64 = line.trim().strip_suffix("kB")?.trim_end().parse().ok()?;
    Some(kib * 1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_is_read_after_each_pause() {
        let pause = Duration::from_secs(30);
        let mut rounds = MemoryRounds::new(pause);
        let due = rounds.deadline();
        assert!(due > Instant::now());
        assert!(!rounds.is_due(Instant::now()));
        assert!(rounds.is_due(due));
        assert_eq!(rounds.deadline(), due + pause);
    }

    #[test]
    fn the_memory_of_a_process_is_in_bytes() {
        let own = std::process::id().try_into().expect("a pid");
        let bytes = resident(own).expect("it runs");
        assert!((1 << 20..1 << 34).contains(&bytes), "{bytes}");
        assert_eq!(resident(-1), None);
    }
}
