//! Openings happen together, cleaning up after the dead happens alone.
//!
//! iceoryx2 0.10.0 makes a service in steps, and its clean-up removes a service whose steps are not all done as the
//! work of a dead process, although a living one may be at it just then: the service then exists for that one alone.
//! So who opens holds a shared lock on the network's root, and who cleans holds it alone. A process that is killed
//! loses its lock.

use rustix::fs::{FlockOperation, flock};
use std::fs::File;
use std::path::Path;
use std::time::{Duration, Instant};

/// How long either waits for the other, in order that a process which was stopped in the middle harms nobody: then it
/// goes on without the lock, which is as safe as iceoryx2 is by itself.
const PATIENCE: Duration = Duration::from_millis(500);
/// Between two attempts.
const PAUSE: Duration = Duration::from_millis(1);

/// A lock that is held, or that could not be had in time.
pub(crate) struct Lock {
    _file: Option<File>,
}

/// To open services.
pub(crate) fn together(root: &Path) -> Lock {
    lock(root, FlockOperation::NonBlockingLockShared)
}

/// To clean up after the dead.
pub(crate) fn alone(root: &Path) -> Lock {
    lock(root, FlockOperation::NonBlockingLockExclusive)
}

fn lock(root: &Path, operation: FlockOperation) -> Lock {
    let Ok(file) = File::open(root) else {
        return Lock { _file: None };
    };
    let end = Instant::now() + PATIENCE;
    loop {
        match flock(&file, operation) {
            Ok(()) => return Lock { _file: Some(file) },
            Err(_) if Instant::now() < end => std::thread::sleep(PAUSE),
            Err(_) => return Lock { _file: None },
        }
    }
}
