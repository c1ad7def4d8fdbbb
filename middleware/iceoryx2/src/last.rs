//! The last one out of a network turns off the light: where nobody is left, nothing of it stays in shared memory.
//!
//! Every process of a network holds a shared lock on one file in its run directory, as long as it has a node. Who
//! leaves and can have the lock for itself alone is the last one, and wipes; who comes meanwhile waits for that.
//! A process that is killed loses its lock, so it counts as gone.

use crate::estate;
use rc_middleware::RunDirectory;
use rustix::fs::{FlockOperation, flock};
use std::fs::File;
use std::io;
use std::os::unix::fs::MetadataExt;
use std::path::PathBuf;

/// A presence in a network.
pub(crate) struct Presence {
    directory: RunDirectory,
    lock: File,
}

impl Presence {
    /// Enters the network. It waits while somebody wipes, which is short; the caller bounds it all the same.
    pub(crate) fn enter(directory: &RunDirectory) -> io::Result<Self> {
        loop {
            let path = path(directory);
            let lock = File::create(&path)?;
            flock(&lock, FlockOperation::LockShared)?;
            // The file may have been removed by the last one out between the two calls.
            match std::fs::metadata(&path) {
                Ok(there) if there.ino() == lock.metadata()?.ino() => {
                    return Ok(Self {
                        directory: directory.clone(),
                        lock,
                    });
                }
                _ => {}
            }
        }
    }
}

impl Drop for Presence {
    fn drop(&mut self) {
        if flock(&self.lock, FlockOperation::NonBlockingLockExclusive).is_ok() {
            // What cannot be removed is seen by the next deployer; there is nobody to tell here.
            let _ = estate::wipe(&self.directory);
            let _ = std::fs::remove_file(path(&self.directory));
        }
    }
}

fn path(directory: &RunDirectory) -> PathBuf {
    directory.path().join("iceoryx2.lock")
}
