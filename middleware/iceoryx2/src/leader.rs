//! Leader election by file locks with a lease.
//!
//! The leader renews its lease by touching its file. A killed leader loses the lock. A stopped one
//! keeps it, but its lease expires; then a candidate leads from the next lock file. The
//! work must be safe to do twice, because a stopped leader may continue.

use rustix::fs::{FlockOperation, flock};
use std::fs::File;
use std::io;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};

/// Time after the last renewal at which a leader counts as stopped.
const LEASE: Duration = Duration::from_secs(1);
/// How many leaders may be stopped at once.
const LOCK_FILES: usize = 4;

/// One candidate.
pub(crate) struct LeaderLock {
    lock_files: Vec<LockFile>,
    /// The number of the lock file by which it leads, and the locked file.
    held: Option<(usize, File)>,
}

/// A lock file, and when its holder last renewed its lease, as far as this candidate has seen.
struct LockFile {
    path: PathBuf,
    renewed: Option<(SystemTime, Instant)>,
}

impl LockFile {
    /// Whether the holder has not renewed its lease for too long. Compares the time of the file
    /// with the one that this candidate saw before, never with the clock, which may be set.
    fn is_expired(&mut self, file: &File) -> io::Result<bool> {
        let modified = file.metadata()?.modified()?;
        match self.renewed {
            Some((seen, since)) if seen == modified => Ok(since.elapsed() > LEASE),
            _ => {
                self.renewed = Some((modified, Instant::now()));
                Ok(false)
            }
        }
    }
}

impl LeaderLock {
    /// `path` is the first lock file, the same for all candidates.
    pub(crate) fn new(path: &Path) -> Self {
        let lock_file = |number: usize| {
            let mut path = path.to_owned();
            if number > 0 {
                path.set_extension(format!("lock{number}"));
            }
            LockFile {
                path,
                renewed: None,
            }
        };
        Self {
            lock_files: (0..LOCK_FILES).map(lock_file).collect(),
            held: None,
        }
    }

    /// Whether this candidate leads now. Renews the lease; call it several times within [`LEASE`].
    pub(crate) fn is_leader(&mut self) -> bool {
        // If no file can be locked, every candidate leads.
        self.try_lead().unwrap_or(true)
    }

    /// Whether this candidate led at its last [`LeaderLock::is_leader`].
    pub(crate) fn leads(&self) -> bool {
        self.held.is_some()
    }

    /// Whether the first lock file was renewed since the last look at it: then its holder lives.
    pub(crate) fn was_renewed(&mut self) -> bool {
        let [first, ..] = &mut self.lock_files[..] else {
            return false;
        };
        let modified = std::fs::metadata(&first.path).and_then(|file| file.modified());
        let Ok(modified) = modified else {
            return false;
        };
        let is_new = first.renewed.is_none_or(|(seen, _)| seen != modified);
        if is_new {
            first.renewed = Some((modified, Instant::now()));
        }
        is_new
    }

    /// Lets another candidate lead.
    pub(crate) fn resign(&mut self) {
        self.held = None;
    }

    fn try_lead(&mut self) -> io::Result<bool> {
        if let Some((_, file)) = &self.held
            && file.metadata()?.nlink() == 0
        {
            self.held = None;
        }
        for (number, lock_file) in self.lock_files.iter_mut().enumerate() {
            if let Some((held, file)) = &self.held
                && *held == number
            {
                file.set_modified(SystemTime::now())?;
                return Ok(true);
            }
            let mut options = File::options();
            let file = options.create(true).truncate(false).write(true);
            let file = file.open(&lock_file.path)?;
            if flock(&file, FlockOperation::NonBlockingLockExclusive).is_ok() {
                file.set_modified(SystemTime::now())?;
                self.held = Some((number, file));
                return Ok(true);
            }
            if !lock_file.is_expired(&file)? {
                self.held = None;
                return Ok(false);
            }
        }
        Ok(false)
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
        let new = || LeaderLock::new(&path);
        let (mut first, mut second, mut third) = (new(), new(), new());
        assert!(first.is_leader() && !second.is_leader() && !third.is_leader());
        assert!(first.is_leader());
        // The leader is stopped. A clock that is set meanwhile does not matter.
        let file = File::options().write(true).open(&path).expect("the lock");
        let future = SystemTime::now() + Duration::from_hours(1);
        file.set_modified(future).expect("a time");
        assert!(!second.is_leader() && !third.is_leader());
        let long_ago = Instant::now().checked_sub(2 * LEASE).expect("a time");
        for candidate in [&mut second, &mut third] {
            candidate.lock_files[0].renewed = Some((future, long_ago));
        }
        assert!(second.is_leader() && !third.is_leader());
        // It goes on, so the second one no longer leads.
        assert!(second.is_leader() && first.is_leader());
        assert!(!second.is_leader() && !third.is_leader());
        // The leader is killed, the next one resigns.
        drop(first);
        assert!(second.is_leader() && !third.is_leader());
        second.resign();
        assert!(third.is_leader() && !second.is_leader());
        third.resign();
        // The folder is removed and created again.
        std::fs::remove_dir_all(&folder).expect("it is ours");
        assert!(second.is_leader() && third.is_leader());
        std::fs::create_dir_all(&folder).expect("a folder");
        assert!(third.is_leader() && !second.is_leader());
        std::fs::remove_dir_all(&folder).expect("it is ours");
    }
}
