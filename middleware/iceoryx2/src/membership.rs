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
use crate::mutex::lock;
use crate::names::Storage;
use crate::{nodes, service_files};
use rc_middleware::RunDirectory;
use rustix::fs::{FlockOperation, flock};
use std::fs::File;
use std::io::{self, ErrorKind};
use std::os::unix::fs::{DirBuilderExt, MetadataExt};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, Weak};

/// The memberships of this process.
static ALL: Mutex<Vec<Weak<Membership>>> = Mutex::new(Vec::new());

/// Leaves all networks. Call it where the process is about to end although something in it still
/// uses shared memory, such as a sample that a thread keeps: memory that is mapped stays valid, and
/// if no other process is in a network, its files are removed. The process may open nothing
/// afterwards.
pub fn leave_all() {
    let all: Vec<_> = lock(&ALL).drain(..).collect();
    let all: Vec<_> = all.iter().filter_map(Weak::upgrade).collect();
    // Several of them may be in one network.
    for membership in &all {
        let _ = flock(&membership.lock, FlockOperation::Unlock);
    }
    for membership in all {
        membership.leave();
    }
}

/// Membership of this process in a network.
pub(crate) struct Membership {
    directory: RunDirectory,
    lock: File,
}

impl Membership {
    /// Joins the network. The first process alive removes the files of dead ones and chooses the
    /// place of the new ones, unless an external program is alive. Waits while another process
    /// removes files; the caller limits the time.
    pub(crate) fn join(directory: &RunDirectory) -> io::Result<(Arc<Self>, Storage)> {
        loop {
            let lock = match File::create(path(directory)) {
                // The last process that left has removed the folder since it was created.
                Err(error) if error.kind() == ErrorKind::NotFound => {
                    private(directory.path())?;
                    continue;
                }
                file => file?,
            };
            let membership = Self {
                directory: directory.clone(),
                lock,
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
                return Ok((membership.noted(), place));
            }
        }
    }

    /// Adds it to [`ALL`].
    fn noted(self) -> Arc<Self> {
        let membership = Arc::new(self);
        let mut all = lock(&ALL);
        all.retain(|other| other.strong_count() > 0);
        all.push(Arc::downgrade(&membership));
        membership
    }

    /// Whether an external program has a live node. Call it only while no other process holds the
    /// lock.
    fn has_external_nodes(&self) -> bool {
        let Ok(Some(place)) = Storage::find(&self.directory) else {
            return false;
        };
        configuration(&place).is_ok_and(|config| nodes::any_alive_elsewhere(&config))
    }

    /// If this process is the last one in the network, removes the files and the folder of a
    /// network without a deployer.
    fn leave(&self) {
        // If a deployer has removed the run directory, another network may already use the path.
        let last = flock(&self.lock, FlockOperation::NonBlockingLockExclusive).is_ok();
        if last && self.is_current() && !self.has_external_nodes() {
            // The next process that joins reports what cannot be removed.
            let _ = service_files::wipe(&self.directory);
            let _ = std::fs::remove_file(path(&self.directory));
            // A component that ended earlier could not remove it, while this file was in it.
            let _ = std::fs::remove_dir(self.directory.path());
        }
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
        self.leave();
    }
}

fn path(directory: &RunDirectory) -> PathBuf {
    directory.path().join("iceoryx2.lock")
}

/// Creates the folder with access for this user alone; refuses a folder of another user.
pub(crate) fn private(root: &Path) -> std::io::Result<()> {
    std::fs::DirBuilder::new()
        .recursive(true)
        .mode(0o700)
        .create(root)?;
    let found = std::fs::symlink_metadata(root)?;
    if found.is_dir() && found.uid() == rustix::process::getuid().as_raw() {
        Ok(())
    } else {
        Err(std::io::Error::other("not a folder of this user"))
    }
}
