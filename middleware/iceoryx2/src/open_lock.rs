//! Openings happen together, cleaning up after the dead happens alone.
//!
//! iceoryx2 0.10.0 makes a service in steps, and its clean-up removes a service whose steps are not all done as the
//! work of a dead process, although a living one may be at it just then: the service then exists for that one alone.
//! So who opens holds a shared lock on the network's root, and who cleans up after one of the dead holds it alone.
//! Between two of the dead it is free for a while, which those who clean see to with a lock of their own: where many
//! die and many clean, openings do not wait for the last of them. A process that is killed loses its locks.

use rustix::fs::{FlockOperation, flock};
use std::fs::File;
use std::path::Path;
use std::time::{Duration, Instant};

/// How long either waits for the other, in order that a process which was stopped in the middle harms nobody: then it
/// goes on without the lock, which is as safe as iceoryx2 is by itself. To clean up after one of the dead takes some
/// milliseconds, on a busy machine a tenth of a second.
const TIMEOUT: Duration = Duration::from_millis(500);
/// Between two attempts.
const RETRY_INTERVAL: Duration = Duration::from_millis(1);
/// How long openings go first after each of the dead: some attempts long.
const OPENING_WINDOW: Duration = Duration::from_millis(5);

/// A lock that is held, or that could not be had in time.
pub(crate) struct OpenLock {
    _file: Option<File>,
}

/// The locks of who cleans.
pub(crate) struct CleanupLock {
    root: OpenLock,
    _cleaning: OpenLock,
}

impl CleanupLock {
    /// Lets openings go first, then the next one who cleans.
    pub(crate) fn release(self) {
        drop(self.root);
        std::thread::sleep(OPENING_WINDOW);
    }
}

/// To open services.
pub(crate) fn shared(root: &Path) -> OpenLock {
    lock(File::open(root), FlockOperation::NonBlockingLockShared)
}

/// To clean up after one of the dead; none where that was `needed` no more while this one waited for others who clean.
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
