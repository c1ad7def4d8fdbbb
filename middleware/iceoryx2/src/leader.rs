//! Leader election by a file lock with a lease.
//!
//! The leader renews its lease by touching the file. A killed leader loses the lock. A stopped one
//! keeps it, but its lease expires; then every other process does the work, which must therefore be
//! safe to do twice.

use rustix::fs::{FlockOperation, flock};
use std::fs::File;
use std::io;
use std::os::unix::fs::MetadataExt;
use std::path::PathBuf;
use std::time::{Duration, SystemTime};

/// Time after the last renewal at which other processes act, too.
const LEASE: Duration = Duration::from_secs(1);

/// One candidate.
pub(crate) struct LeaderLock {
    path: PathBuf,
    held: Option<File>,
}

impl LeaderLock {
    /// `path` is the lock file, the same for all candidates.
    pub(crate) fn new(path: PathBuf) -> Self {
        Self { path, held: None }
    }

    /// Whether this process has to act now. Renews the lease; call it several times within
    /// [`LEASE`].
    pub(crate) fn is_leader(&mut self) -> bool {
        // If the file cannot be locked, every process acts.
        self.try_lead().unwrap_or(true)
    }

    fn try_lead(&mut self) -> io::Result<bool> {
        if let Some(file) = &self.held
            && file.metadata()?.nlink() > 0
        {
            file.set_modified(SystemTime::now())?;
            return Ok(true);
        }
        self.held = None;
        let mut options = File::options();
        let file = options.create(true).truncate(false).write(true);
        let file = file.open(&self.path)?;
        if flock(&file, FlockOperation::NonBlockingLockExclusive).is_ok() {
            file.set_modified(SystemTime::now())?;
            self.held = Some(file);
            return Ok(true);
        }
        let silence = file.metadata()?.modified()?.elapsed();
        // A renewal in the future means that the clock was set back.
        Ok(silence.is_ok_and(|time| time > LEASE))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_is_one_leader_until_it_dies_or_its_lease_expires() {
        let folder = std::env::temp_dir().join(format!("rc-leader-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("a folder");
        let path = folder.join("leader.lock");
        let new = || LeaderLock::new(path.clone());
        let (mut first, mut second, mut third) = (new(), new(), new());
        assert!(first.is_leader() && !second.is_leader() && !third.is_leader());
        assert!(first.is_leader());
        // The leader is stopped.
        let file = File::options().write(true).open(&path).expect("the lock");
        let past = SystemTime::now() - 2 * LEASE;
        file.set_modified(past).expect("a time");
        assert!(second.is_leader() && third.is_leader());
        assert!(first.is_leader() && !second.is_leader());
        // The leader is killed.
        drop(first);
        assert!(second.is_leader() && !third.is_leader());
        // The folder is removed and created again.
        std::fs::remove_dir_all(&folder).expect("it is ours");
        assert!(second.is_leader() && third.is_leader());
        std::fs::create_dir_all(&folder).expect("a folder");
        assert!(third.is_leader() && !second.is_leader());
        std::fs::remove_dir_all(&folder).expect("it is ours");
    }
}
