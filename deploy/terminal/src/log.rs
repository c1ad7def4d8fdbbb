//! The log that is shown, as it grows.

use rc_deploy_client::{DirectoryWatch, Follower};
use std::os::fd::AsFd;
use std::os::fd::BorrowedFd;
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// The log of one component.
pub(super) struct Log {
    pub(super) name: String,
    path: PathBuf,
    watch: Option<DirectoryWatch>,
    follower: Option<Follower>,
    /// When to read again after a write.
    pub(super) due: Option<Instant>,
}

impl Log {
    /// A log that is read at `now` for the first time.
    pub(super) fn new(name: String, path: PathBuf, now: Instant) -> Self {
        let folder = path.parent();
        Self {
            name,
            watch: folder.and_then(|folder| DirectoryWatch::new(folder).ok()),
            path,
            follower: None,
            due: Some(now),
        }
    }

    /// Becomes readable after a write. There is none while a read is due.
    pub(super) fn descriptor(&self) -> Option<BorrowedFd<'_>> {
        let watch = self.watch.as_ref().filter(|_| self.due.is_none());
        watch.map(|watch| watch.descriptor().as_fd())
    }

    /// Something was written. It is read after `pause`, so that a flood is shown a few times a
    /// second.
    pub(super) fn wake(&mut self, pause: Duration) {
        self.watch.iter().for_each(DirectoryWatch::drain);
        self.due = Some(Instant::now() + pause);
    }

    /// Reads new lines if a read is due: at most `count` at first.
    pub(super) fn read(&mut self, now: Instant, count: usize, pause: Duration) -> Vec<String> {
        if self.due.is_none_or(|due| now < due) {
            return Vec::new();
        }
        self.due = None;
        if let Some(follower) = &mut self.follower {
            let (lines, more) = follower.read();
            self.due = more.then(|| now + pause);
            return lines;
        }
        match Follower::at_last_lines(&self.path, count) {
            Ok((lines, follower)) => {
                self.follower = Some(follower);
                lines
            }
            Err(error) => vec![format!("{}: {error}", self.path.display())],
        }
    }
}
