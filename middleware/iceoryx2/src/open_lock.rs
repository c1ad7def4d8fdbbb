//! A readers-writer lock: openings run concurrently, a clean-up excludes them.
//!
//! iceoryx2 0.10.0 creates a service in steps. Its clean-up removes a service whose steps are not
//! complete, although a live process may be creating it at that moment; the service then exists for
//! that process alone. Openings therefore hold a shared lock on the root folder of the network, and
//! the process that cleans up holds it exclusively.
//!
//! `flock` lets new readers pass a waiting writer. Each opening therefore first passes a turnstile,
//! `opening.lock`, which the writer holds while it waits: it waits for the openings in progress,
//! never for later ones. The kernel releases the locks of a killed process.

use rustix::fs::{FlockOperation, flock};
use std::fs::File;
use std::io;
use std::path::Path;
use std::time::{Duration, Instant};

/// Time limit of waiting for a lock, in case its holder was stopped. Afterwards the process
/// continues without the lock, which is as safe as iceoryx2 is by itself.
pub(crate) const TIMEOUT: Duration = Duration::from_millis(500);
/// Pauses between two attempts, from the first to the longest: a hundred processes may wait.
const PAUSES: [Duration; 2] = [Duration::from_millis(1), Duration::from_millis(8)];
/// Time that the root stays unlocked after a clean-up: longer than the longest pause.
pub(crate) const OPENING_WINDOW: Duration = Duration::from_millis(10);

/// A held lock, or none if the time limit expired.
pub(crate) struct OpenLock {
    file: Option<File>,
}

impl OpenLock {
    /// Whether the lock is held.
    pub(crate) fn is_held(&self) -> bool {
        self.file.is_some()
    }
}

/// Locks the root for an opening.
pub(crate) fn shared(root: &Path) -> OpenLock {
    let operation = FlockOperation::NonBlockingLockShared;
    let _turnstile = lock(turnstile(root), operation, TIMEOUT);
    lock(File::open(root), operation, TIMEOUT)
}

/// Locks the root for a clean-up. Waits at most for `limit`.
pub(crate) fn exclusive(root: &Path, limit: Duration) -> OpenLock {
    let operation = FlockOperation::NonBlockingLockExclusive;
    let _turnstile = lock(turnstile(root), operation, limit);
    lock(File::open(root), operation, limit)
}

fn turnstile(root: &Path) -> io::Result<File> {
    File::create(root.join("opening.lock"))
}

fn lock(file: io::Result<File>, operation: FlockOperation, limit: Duration) -> OpenLock {
    let Ok(file) = file else {
        return OpenLock { file: None };
    };
    let end = Instant::now() + limit;
    let [mut pause, longest] = PAUSES;
    while flock(&file, operation).is_err() {
        if Instant::now() >= end {
            return OpenLock { file: None };
        }
        std::thread::sleep(pause);
        pause = (pause * 2).min(longest);
    }
    OpenLock { file: Some(file) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicBool, Ordering};

    /// Openings overlap so that the root is never unlocked.
    #[test]
    fn a_clean_up_is_not_kept_out_by_openings_that_follow_each_other() {
        let folder = tempfile::tempdir().expect("a folder");
        let (root, ended) = (folder.path(), AtomicBool::new(false));
        let held = std::thread::scope(|scope| {
            for _ in 0..8 {
                scope.spawn(|| {
                    while !ended.load(Ordering::Relaxed) {
                        let _opening = shared(root);
                        std::thread::sleep(Duration::from_millis(4));
                    }
                });
            }
            std::thread::sleep(Duration::from_millis(20));
            let held = exclusive(root, Duration::from_secs(20)).is_held();
            ended.store(true, Ordering::Relaxed);
            held
        });
        assert!(held);
    }
}
