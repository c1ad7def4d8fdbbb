//! Log rotation: a log beyond its limit is copied to `NAME.log.1` and emptied.
//!
//! Components write into their logs directly, so that a slow supervisor never blocks them; their
//! open files cannot be replaced. Therefore the log is copied, in place of the older part, and
//! emptied. Output between the copy and the emptying is lost. The first line of the older
//! part has its number and how many bytes were left out: if a log has grown beyond twice its limit,
//! only its end is kept.
//!
//! A write to a log wakes the supervisor, at most four times a second. Without writes, it does
//! nothing.

use crate::log::reporter::Reporter;
use rc_deploy_client::log_parts::{Header, beside, older};
use rc_deploy_client::{DirectoryWatch, logs};
use rc_files::{Disk, DiskChange};
use rc_management::event::{Event, Severity};
use rustix::fs::{FlockOperation, flock};
use std::fs::File;
use std::io::{self, ErrorKind, Read, Seek, SeekFrom, Write};
use std::os::fd::OwnedFd;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// The default limit of a log in bytes.
pub(crate) const LIMIT: u64 = 16 << 20;
/// The shortest time between two checks, and between two steps of one check.
const PAUSE: Duration = Duration::from_millis(250);
const SOON: Duration = Duration::from_millis(50);
/// How many steps a rotation waits for a reader of the log. A stopped reader does not delay it any
/// longer.
const PATIENCE: u32 = 20;
/// Rotates the logs of a network.
#[derive(Debug)]
pub(crate) struct Rotation {
    limit: u64,
    directory: PathBuf,
    logs: Vec<PathBuf>,
    watch: DirectoryWatch,
    due: Option<Instant>,
    waited: u32,
    disk: Disk,
}

impl Rotation {
    pub(crate) fn new(directory: &Path, logs: Vec<PathBuf>, limit: u64) -> io::Result<Self> {
        Ok(Self {
            limit,
            directory: directory.to_owned(),
            logs,
            watch: DirectoryWatch::new(directory)?,
            due: None,
            waited: 0,
            disk: Disk::with(limit, limit.saturating_mul(4)),
        })
    }

    /// Makes the folder of the logs and the logs again if somebody has removed the folder. Returns
    /// whether that was so.
    pub(crate) fn restore(&mut self) -> io::Result<bool> {
        if self.watch.is_current(&self.directory) {
            return Ok(false);
        }
        logs::make_folder(&self.directory)?;
        let mut options = File::options();
        for log in &self.logs {
            options.create(true).append(true).open(log)?;
        }
        self.watch = DirectoryWatch::new(&self.directory)?;
        Ok(true)
    }

    pub(crate) fn directory(&self) -> &Path {
        &self.directory
    }

    /// Becomes readable after a write. There is none while a check is due.
    pub(crate) fn descriptor(&self) -> Option<&OwnedFd> {
        self.due.is_none().then(|| self.watch.descriptor())
    }

    pub(crate) fn deadline(&self) -> Option<Instant> {
        self.due
    }

    /// Notes a write.
    pub(crate) fn wake(&mut self) {
        self.watch.drain();
        self.due.get_or_insert_with(|| Instant::now() + PAUSE);
    }

    /// Rotates the longest log if a check is due and the log is too long. Returns a change of the
    /// disk.
    pub(crate) fn check(&mut self, now: Instant, report: &Reporter) -> Option<DiskChange> {
        if self.due.is_none_or(|due| now < due) {
            return None;
        }
        self.due = None;
        let length = |log: &PathBuf| std::fs::metadata(log).map_or(0, |file| file.len());
        let mut long: Vec<(u64, &PathBuf)> =
            self.logs.iter().map(|log| (length(log), log)).collect();
        long.retain(|(length, _)| *length > self.limit);
        long.sort_unstable();
        let Some((_, log)) = long.last() else {
            return self.check_disk();
        };
        let insist = self.waited >= PATIENCE;
        let rotated = rotate(log, self.limit, insist);
        self.waited += 1;
        self.due = Some(now + SOON);
        match rotated {
            Ok(RotationResult::Busy) => return None,
            Ok(RotationResult::Done) => {}
            Ok(RotationResult::Emptied(error)) | Err(error) => {
                let text = format!("{} is emptied without a copy: {error}", log.display());
                report.event(Event::network(Severity::Warning, "log-lost", text));
            }
        }
        self.waited = 0;
        self.check_disk()
    }

    /// Looks at the room of the disk. Removes the older parts of logs when it becomes full.
    pub(crate) fn check_disk(&mut self) -> Option<DiskChange> {
        let change = self.disk.look(Disk::free(&self.directory).ok()?)?;
        if matches!(change, DiskChange::Full { .. }) {
            for log in &self.logs {
                let _ = std::fs::remove_file(older(log));
            }
        }
        Some(change)
    }
}

enum RotationResult {
    Done,
    /// A reader holds the log.
    Busy,
    /// The log could not be copied, and was emptied.
    Emptied(io::Error),
}

/// Moves the contents of a log to its older part. A reader holds a lock, which is respected unless
/// `insist`.
fn rotate(log: &Path, limit: u64, insist: bool) -> io::Result<RotationResult> {
    let file = File::options().read(true).write(true).open(log)?;
    match flock(&file, FlockOperation::NonBlockingLockExclusive) {
        Err(error) if error == rustix::io::Errno::WOULDBLOCK && !insist => {
            return Ok(RotationResult::Busy);
        }
        _ => {}
    }
    let kept = match keep(log, &file, limit) {
        // The disk may have no room for the earlier part and this one.
        Err(error) if error.kind() == ErrorKind::StorageFull => {
            std::fs::remove_file(older(log)).and_then(|()| keep(log, &file, limit))
        }
        other => other,
    };
    file.set_len(0)?;
    Ok(match kept {
        Ok(()) => RotationResult::Done,
        Err(error) => {
            // A reader that continues must not mistake it for the removed file.
            let _ = std::fs::remove_file(older(log));
            RotationResult::Emptied(error)
        }
    })
}

fn keep(log: &Path, mut file: &File, limit: u64) -> io::Result<()> {
    let length = file.metadata()?.len();
    let left_out = if length > 2 * limit {
        length - limit
    } else {
        0
    };
    let part = Header::of(log).map_or(0, |(header, _)| header.part) + 1;
    let header = Header {
        part,
        left_out,
        length: 0,
    };
    let new = beside(log, ".new");
    let copied = (|| {
        let mut copy = File::create(&new)?;
        copy.write_all(header.line().as_bytes())?;
        file.seek(SeekFrom::Start(left_out))?;
        io::copy(&mut file.take(2 * limit), &mut copy)?;
        // The lines that arrived meanwhile.
        io::copy(&mut file.take(limit), &mut copy)?;
        std::fs::rename(&new, older(log))
    })();
    if copied.is_err() {
        let _ = std::fs::remove_file(&new);
    }
    copied
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_end_of_a_far_too_long_log_is_kept() {
        let folder = tempfile::tempdir().expect("a folder");
        let log = folder.path().join("a.log");
        std::fs::write(&log, "0123456789".repeat(10)).expect("written");
        assert!(matches!(rotate(&log, 30, false), Ok(RotationResult::Done)));
        let older = std::fs::read_to_string(older(&log)).expect("a part");
        let expected = "[rcdeploy: part 1 of this log, without its first 70 bytes]\n";
        assert_eq!(older, expected.to_owned() + &"0123456789".repeat(3));
        assert_eq!(std::fs::metadata(&log).expect("the log").len(), 0);
    }

    #[test]
    fn rotation_waits_for_readers_for_a_limited_time() {
        let folder = tempfile::tempdir().expect("a folder");
        let log = folder.path().join("a.log");
        std::fs::write(&log, "text").expect("written");
        let reader = File::open(&log).expect("the log");
        flock(&reader, FlockOperation::LockShared).expect("a lock");
        assert!(matches!(rotate(&log, 1, false), Ok(RotationResult::Busy)));
        assert!(matches!(rotate(&log, 1, true), Ok(RotationResult::Done)));
    }
}
