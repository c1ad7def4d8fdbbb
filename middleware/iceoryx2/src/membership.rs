//! The first one into a network sweeps, and the last one out turns off the light: where nobody is alive, nothing of
//! the network stays in shared memory, and nothing that the dead left half made is in the way of those who come.
//!
//! Every process of a network holds a shared lock on one file in its run directory, as long as it has a node; so does
//! the guard of a deployer, which holds the services. Who can have the lock for itself alone is the only one alive:
//! it wipes, before it makes its node or after it has left. Who comes meanwhile waits for that. A process that is
//! killed loses its lock, so it counts as gone. Where strangers have live nodes in it, programs that use iceoryx2
//! without this crate and hold no lock, nobody wipes; the first one to come when they are gone does.

use crate::{nodes, service_files};
use iceoryx2::prelude::Config;
use rc_middleware::RunDirectory;
use rustix::fs::{FlockOperation, flock};
use std::fs::File;
use std::io;
use std::os::unix::fs::MetadataExt;
use std::path::PathBuf;

/// A membership in a network.
pub(crate) struct Membership {
    directory: RunDirectory,
    config: Config,
    lock: File,
}

impl Membership {
    /// Enters the network. Who is the first one alive wipes what the dead left, unless there are strangers. It waits
    /// while somebody wipes, which is short; the caller bounds it all the same.
    pub(crate) fn join(directory: &RunDirectory, config: &Config) -> io::Result<Self> {
        loop {
            let membership = Self {
                directory: directory.clone(),
                config: config.clone(),
                lock: File::create(path(directory))?,
            };
            let first = flock(&membership.lock, FlockOperation::NonBlockingLockExclusive).is_ok();
            if first && membership.is_current() && !membership.has_external_nodes() {
                service_files::wipe(directory)?;
            }
            // The lock may be lost for a moment while it changes its kind, and another one may wipe in that moment:
            // there is nothing of ours yet.
            flock(&membership.lock, FlockOperation::LockShared)?;
            // The file may have been removed by the last one out since it was opened.
            if membership.is_current() {
                return Ok(membership);
            }
        }
    }

    /// Whether there are live strangers, where nobody else holds the lock and this process has no node: programs that use
    /// iceoryx2 without this crate hold none.
    fn has_external_nodes(&self) -> bool {
        nodes::any_alive(&self.config)
    }

    /// Whether the file that is locked is the one that others find.
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
        // Where a deployer has removed the run directory, another network may have its place already.
        let last = flock(&self.lock, FlockOperation::NonBlockingLockExclusive).is_ok();
        if last && self.is_current() && !self.has_external_nodes() {
            // What cannot be removed is told to the next one who comes; there is nobody to tell here.
            let _ = service_files::wipe(&self.directory);
            let _ = std::fs::remove_file(path(&self.directory));
        }
    }
}

fn path(directory: &RunDirectory) -> PathBuf {
    directory.path().join("iceoryx2.lock")
}
