//! A readers-writer lock: openings run concurrently, a clean-up excludes them.
//!
//! iceoryx2 0.10.0 creates a service in steps. Its clean-up removes a service whose steps are not
//! complete, although a live process may be creating it at that moment; the service then exists for
//! that process alone. Openings therefore hold a shared lock on the root folder of the network, and
//! a clean-up after one dead node holds it exclusively. Processes that clean up hold a second lock,
//! `cleaning.lock`, and leave the root unlocked for a while between two dead nodes, so that
//! openings do not wait until all are removed. The kernel releases the locks of a killed process.

use rustix::fs::{FlockOperation, flock};
use std::fs::File;
use std::path::Path;
use std::time::{Duration, Instant};

/// Time limit of waiting for a lock, in case its holder was stopped. Afterwards the process
/// continues without the lock, which is as safe as iceoryx2 is by itself. A clean-up takes some
/// milliseconds, on a busy machine a tenth of a second.
const TIMEOUT: Duration = Duration::from_millis(500);
/// Pause between two attempts.
const RETRY_INTERVAL: Duration = Duration::from_millis(1);
/// Time that the root stays unlocked after each dead node: some attempts long.
const OPENING_WINDOW: Duration = Duration::from_millis(5);

/// A held lock, or none if the time limit expired.
pub(crate) struct OpenLock {
    _file: Option<File>,
}

/// The locks of a process that cleans up.
pub(crate) struct CleanupLock {
    root: OpenLock,
    _cleaning: OpenLock,
}

impl CleanupLock {
    /// Unlocks the root for waiting openings, then admits the next process that cleans up.
    pub(crate) fn release(self) {
        drop(self.root);
        std::thread::sleep(OPENING_WINDOW);
    }
}

/// Locks the root for an opening.
pub(crate) fn shared(root: &Path) -> OpenLock {
    lock(File::open(root), FlockOperation::NonBlockingLockShared)
}

/// Locks the root for the clean-up after one dead node. Returns `None` if `needed` turns false
/// while waiting.
pub(crate) fn exclusive(root: &Path, needed: impl Fn() -> bool) -> Option<CleanupLock> {
    let cleaning = File::create(root.join("cleaning.lock"));
    let cleaning = lock_while(
        cleaning,
        FlockOperation::NonBlockingLockExclusive,
        OPENING_WINDOW,
        needed,
    )?;
    Some(CleanupLock {
        root: lock(File::open(root), FlockOperation::NonBlockingLockExclusive),
        _cleaning: cleaning,
    })
}

fn lock(file: std::io::Result<File>, operation: FlockOperation) -> OpenLock {
    lock_while(file, operation, RETRY_INTERVAL, || true).unwrap_or(OpenLock { _file: None })
}

fn lock_while(
    file: std::io::Result<File>,
    operation: FlockOperation,
    pause: Duration,
    needed: impl Fn() -> bool,
) -> Option<OpenLock> {
    let Ok(file) = file else {
        return Some(OpenLock { _file: None });
    };
    let end = Instant::now() + TIMEOUT;
    while flock(&file, operation).is_err() {
        if !needed() {
            return None;
        }
        if Instant::now() >= end {
            return Some(OpenLock { _file: None });
        }
        std::thread::sleep(pause);
    }
    Some(OpenLock { _file: Some(file) })
}
