//! Membership in a network. The first process that joins and the last one that leaves remove all
//! files and shared memory of the network, so that nothing stays behind and no incomplete file
//! obstructs the next start.
//!
//! Every process holds a shared lock on one file in the run directory as long as it has a node; so
//! does the guard of a deployer. A process that gets the lock exclusively is the only one alive. It
//! removes the files before it creates its node or after it has left, and processes that join
//! meanwhile wait. The kernel releases the lock of a killed process. External programs, which use
//! iceoryx2 without this crate, hold no lock: while one of them has a live node, nobody removes the
//! files, and the first process that joins afterwards does.

use crate::configuration::configuration;
use crate::names::Storage;
use crate::{nodes, service_files};
use rc_middleware::RunDirectory;
use rustix::fs::{FlockOperation, flock};
use std::fs::File;
use std::io;
use std::os::unix::fs::MetadataExt;
use std::path::PathBuf;

/// Membership of this process in a network.
pub(crate) struct Membership {
    directory: RunDirectory,
    lock: File,
}

impl Membership {
    /// Joins the network. The first process alive removes the files of dead ones and chooses the
    /// place of the new ones, unless an external program is alive. Waits while another process
    /// removes files; the caller limits the time.
    pub(crate) fn join(directory: &RunDirectory) -> io::Result<(Self, Storage)> {
        loop {
            let membership = Self {
                directory: directory.clone(),
                lock: File::create(path(directory))?,
            };
            let first = flock(&membership.lock, FlockOperation::NonBlockingLockExclusive).is_ok();
            if first && membership.is_current() && !membership.has_external_nodes() {
                service_files::wipe(directory)?;
                Storage::choose(directory)?;
            }
            // The kernel may release the lock for a moment while it becomes shared, and another
            // process may remove the files in that moment. This process has none yet.
            flock(&membership.lock, FlockOperation::LockShared)?;
            // The last process that left may have removed the file after it was opened here.
            if membership.is_current()
                && let Some(place) = Storage::find(directory)?
            {
                return Ok((membership, place));
            }
        }
    }

    /// Whether an external program has a live node. Call it only while no other process holds the
    /// lock and this process has no node.
    fn has_external_nodes(&self) -> bool {
        let Ok(Some(place)) = Storage::find(&self.directory) else {
            return false;
        };
        configuration(&place).is_ok_and(|config| nodes::any_alive(&config))
    }

    /// Whether the locked file is still the one at its path.
    fn is_current(&self) -> bool {
        let (Ok(ours), Ok(there)) = (
            self.lock.metadata(),
            std::fs::metadata(path(&self.directory)),
        ) else {
            return false;
        };
        (ours.dev(), ours.ino()) == (there.dev(), there.ino())
    }
}

impl Drop for Membership {
    fn drop(&mut self) {
        // If a deployer has removed the run directory, another network may already use the path.
        let last = flock(&self.lock, FlockOperation::NonBlockingLockExclusive).is_ok();
        if last && self.is_current() && !self.has_external_nodes() {
            // The next process that joins reports what cannot be removed.
            let _ = service_files::wipe(&self.directory);
            let _ = std::fs::remove_file(path(&self.directory));
        }
    }
}

fn path(directory: &RunDirectory) -> PathBuf {
    directory.path().join("iceoryx2.lock")
}
