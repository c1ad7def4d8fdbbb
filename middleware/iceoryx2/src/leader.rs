//! Who of many alive does what one of them has to do: the holder of a lock, as long as it says that it is at it.
//!
//! A process that is killed loses the lock. One that was stopped keeps it, and says nothing more: then all others do
//! the work as well, which harms nobody.

use rustix::fs::{FlockOperation, flock};
use std::fs::File;
use std::io;
use std::os::unix::fs::MetadataExt;
use std::path::PathBuf;
use std::time::{Duration, SystemTime};

/// After this time without a word others stand in.
const LEASE: Duration = Duration::from_secs(1);

/// The place of one process among those who may have to do it.
pub(crate) struct LeaderLock {
    path: PathBuf,
    held: Option<File>,
}

impl LeaderLock {
    /// `path` is that of the lock, in a folder that all of them know.
    pub(crate) fn new(path: PathBuf) -> Self {
        Self { path, held: None }
    }

    /// Whether this process is to do it now. It asks several times within [`LEASE`].
    pub(crate) fn is_leader(&mut self) -> bool {
        // Where there can be no lock, everybody does it.
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
        // A word from the future is one of a clock that was set.
        Ok(silence.is_ok_and(|time| time > LEASE))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_does_it_until_it_is_gone_or_silent() {
        let folder = std::env::temp_dir().join(format!("rc-leader-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("a folder");
        let path = folder.join("leader.lock");
        let new = || LeaderLock::new(path.clone());
        let (mut first, mut second, mut third) = (new(), new(), new());
        assert!(first.is_leader() && !second.is_leader() && !third.is_leader());
        assert!(first.is_leader());
        // It is stopped.
        let file = File::options().write(true).open(&path).expect("the lock");
        let past = SystemTime::now() - 2 * LEASE;
        file.set_modified(past).expect("a time");
        assert!(second.is_leader() && third.is_leader());
        assert!(first.is_leader() && !second.is_leader());
        // It is killed.
        drop(first);
        assert!(second.is_leader() && !third.is_leader());
        // The folder is wiped, and made anew.
        std::fs::remove_dir_all(&folder).expect("it is ours");
        assert!(second.is_leader() && third.is_leader());
        std::fs::create_dir_all(&folder).expect("a folder");
        assert!(third.is_leader() && !second.is_leader());
        std::fs::remove_dir_all(&folder).expect("it is ours");
    }
}
