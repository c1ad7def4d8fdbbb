//! A number by which the processes of a component are found when nothing else identifies them.
//!
//! A process hands its resource limits on to its children, whatever they do: `setsid`, `env -i`, a
//! double fork. Linux has ignored the limit of file locks since 2.4.25, so its soft value can be a
//! number of ours, and `/proc/PID/limits` shows it to everybody.

use crate::process::identity::Mark;
use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
use sha2::{Digest, Sha256};
use std::sync::{Mutex, PoisonError};

/// Set in every tag, so that it is not a limit that people set, and less than the greatest one.
const TAGGED: u64 = 1 << 62;
/// The bits that name the run of a component. Those above name the network.
const RUN: u64 = u32::MAX as u64;

/// The tag of one run of a component.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct Tag(u64);

impl Tag {
    /// The tag of a run of a component of the network with `mark`. Processes without a mark have
    /// none.
    pub(crate) fn of(mark: &Mark, run: &str) -> Option<Self> {
        Some(Self(network(mark)? | (hash(run) & RUN)))
    }

    /// The tag of a process, if it has one.
    pub(crate) fn of_process(pid: i32) -> Option<Self> {
        parse(&std::fs::read_to_string(format!("/proc/{pid}/limits")).ok()?)
    }

    /// Whether it belongs to the network with `mark`.
    pub(crate) fn is_of(self, mark: &Mark) -> bool {
        network(mark) == Some(self.0 & !RUN)
    }

    /// Does work that starts a process, which gets this tag. If a limit of this process is below
    /// the tag, it gets none.
    pub(crate) fn give<T>(self, work: impl FnOnce() -> T) -> T {
        // The limit is one of the whole process.
        static ONE: Mutex<()> = Mutex::new(());
        let _one = ONE.lock().unwrap_or_else(PoisonError::into_inner);
        let before = getrlimit(Resource::Locks);
        let tagged = Rlimit {
            current: Some(self.0),
            maximum: before.maximum,
        };
        let _restored = setrlimit(Resource::Locks, tagged)
            .is_ok()
            .then_some(Restore(before));
        work()
    }
}

/// Sets the limit of this process when it is dropped.
struct Restore(Rlimit);

impl Drop for Restore {
    fn drop(&mut self) {
        let before = Rlimit {
            current: self.0.current,
            maximum: self.0.maximum,
        };
        // It was valid before.
        let _ = setrlimit(Resource::Locks, before);
    }
}

/// The part of a tag that names a network.
fn network(mark: &Mark) -> Option<u64> {
    let named = *mark != Mark::none();
    named.then(|| TAGGED | (hash(mark.value()) & !RUN & (TAGGED - 1)))
}

fn hash(text: &str) -> u64 {
    let digest = Sha256::digest(text.as_bytes());
    let bytes = digest.iter().take(8);
    bytes.fold(0, |all, byte| (all << 8) | u64::from(*byte))
}

/// The soft limit of file locks in a `/proc/PID/limits`, if it is a tag.
fn parse(limits: &str) -> Option<Tag> {
    let mut lines = limits.lines();
    let values = lines.find_map(|line| line.strip_prefix("Max file locks"))?;
    let soft: u64 = values.split_ascii_whitespace().next()?.parse().ok()?;
    (soft & TAGGED != 0).then_some(Tag(soft))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::process::identity::Identity;

    fn mark(network: &str) -> Mark {
        Mark::new(network, Identity::own().expect("this process"))
    }

    #[test]
    fn a_tag_names_a_network_and_a_run() {
        let tag = |network: &str, run: &str| Tag::of(&mark(network), run).expect("a mark");
        let first = tag("a", "lidar/1");
        assert_eq!(tag("a", "lidar/1"), first);
        assert!(first.is_of(&mark("a")) && !first.is_of(&mark("b")));
        let other = tag("a", "lidar/2");
        assert!(other != first && other.is_of(&mark("a")));
        assert_ne!(tag("b", "lidar/1"), first);
        assert_eq!(Tag::of(&Mark::none(), "lidar/1"), None);
        assert!(!first.is_of(&Mark::none()));
    }

    #[test]
    fn limits_that_people_set_are_no_tags() {
        let limits = |soft: &str| {
            format!(
                "Limit                     Soft Limit           Hard Limit           Units     \n\
                 Max open files            1024                 4096                 files     \n\
                 Max file locks            {soft}            unlimited            locks     \n"
            )
        };
        for soft in ["unlimited", "0", "1024", ""] {
            assert_eq!(parse(&limits(soft)), None, "{soft}");
        }
        let tag = Tag::of(&mark("a"), "lidar/1").expect("a mark");
        assert_eq!(parse(&limits(&tag.0.to_string())), Some(tag));
        let own = std::process::id().try_into().expect("a pid");
        assert_eq!(Tag::of_process(own), None);
        assert_eq!(Tag::of_process(-1), None);
    }
}
