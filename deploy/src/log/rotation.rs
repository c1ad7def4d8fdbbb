//! Logs do not grow without limit: what is longer than its limit becomes the older part beside it, and the log is empty.
//!
//! Components write into their logs themselves, so that no supervisor that is slow can hold them up; what they write to
//! cannot be replaced. So the log is copied to `NAME.log.1`, in the place of the part before, and emptied. What is printed
//! in the moment between is lost. A first line tells which part this is, and how much was left out: of a log that has
//! grown to more than twice its limit before anybody looked, only the end is kept.
//!
//! A write to a log wakes, at most four times a second; while nothing is written nothing is looked at.

use crate::log::reporter::Reporter;
use rc_deploy_client::DirectoryWatch;
use rc_deploy_client::log_parts::{Header, beside, older};
use rc_management::event::{Event, Severity};
use rustix::fs::{FlockOperation, flock, statvfs};
use std::fs::File;
use std::io::{self, ErrorKind, Read, Seek, SeekFrom, Write};
use std::os::fd::OwnedFd;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// How long a log may become, in bytes, where nobody says anything else.
pub(crate) const LIMIT: u64 = 16 << 20;
/// The shortest time between two looks, and how soon to look again where there was more to do.
const PAUSE: Duration = Duration::from_millis(250);
const SOON: Duration = Duration::from_millis(50);
/// How often somebody who reads a log may be waited for. One who is stopped while reading is not waited for any longer.
const PATIENCE: u32 = 20;
/// Looks after the logs of a network.
#[derive(Debug)]
pub(crate) struct Rotation {
    limit: u64,
    directory: PathBuf,
    logs: Vec<PathBuf>,
    watch: DirectoryWatch,
    due: Option<Instant>,
    waited: u32,
    is_full: bool,
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
            is_full: false,
        })
    }

    /// What to wait for; nothing while a look is due anyway.
    pub(crate) fn descriptor(&self) -> Option<&OwnedFd> {
        self.due.is_none().then(|| self.watch.descriptor())
    }

    pub(crate) fn deadline(&self) -> Option<Instant> {
        self.due
    }

    /// Something was written.
    pub(crate) fn wake(&mut self) {
        self.watch.drain();
        self.due.get_or_insert_with(|| Instant::now() + PAUSE);
    }

    /// Shortens the longest log, if it is time and it is too long.
    pub(crate) fn look(&mut self, now: Instant, report: &Reporter) {
        if self.due.is_none_or(|due| now < due) {
            return;
        }
        self.due = None;
        let length = |log: &PathBuf| std::fs::metadata(log).map_or(0, |file| file.len());
        let mut long: Vec<(u64, &PathBuf)> =
            self.logs.iter().map(|log| (length(log), log)).collect();
        long.retain(|(length, _)| *length > self.limit);
        long.sort_unstable();
        let Some((_, log)) = long.last() else {
            return self.look_at_disk(report);
        };
        let insist = self.waited >= PATIENCE;
        let rotated = rotate(log, self.limit, insist);
        self.waited += 1;
        self.due = Some(now + SOON);
        match rotated {
            Ok(RotationResult::Busy) => return,
            Ok(RotationResult::Done) => {}
            Ok(RotationResult::Emptied(error)) | Err(error) => {
                let text = format!("{} is not kept, it is emptied: {error}", log.display());
                report.event(Event::network(Severity::Warning, "log-lost", text));
            }
        }
        self.waited = 0;
        self.look_at_disk(report);
    }

    /// Tells when there is no room for another log, and makes some by giving up the older parts.
    pub(crate) fn look_at_disk(&mut self, report: &Reporter) {
        let Ok(system) = statvfs(&self.directory) else {
            return;
        };
        let free = system.f_bavail.saturating_mul(system.f_frsize);
        let directory = self.directory.display();
        if free < self.limit && !self.is_full {
            self.is_full = true;
            for log in &self.logs {
                let _ = std::fs::remove_file(older(log));
            }
            let text = format!(
                "the disk of {directory} is full: {} KiB are free. Older parts of logs are removed; components whose output cannot be written decide themselves what that means",
                free >> 10
            );
            report.event(Event::network(Severity::Error, "disk-full", text));
        } else if free >= 4 * self.limit && self.is_full {
            self.is_full = false;
            let text = format!("the disk of {directory} has room again: {} MiB", free >> 20);
            report.event(Event::network(Severity::Info, "disk-free", text));
        }
    }
}

enum RotationResult {
    Done,
    /// Somebody reads it.
    Busy,
    /// There was no way to keep it.
    Emptied(io::Error),
}

/// Makes what is in a log its older part. Whoever reads it at this moment holds a lock, which is respected unless
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
        // The part before may be what has no room beside this one.
        Err(error) if error.kind() == ErrorKind::StorageFull => {
            std::fs::remove_file(older(log)).and_then(|()| keep(log, &file, limit))
        }
        other => other,
    };
    file.set_len(0)?;
    Ok(match kept {
        Ok(()) => RotationResult::Done,
        Err(error) => {
            // What reads on must not take it for what has gone.
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
        // What has come meanwhile.
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
    fn of_a_log_that_is_much_too_long_the_end_is_kept() {
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
    fn who_reads_is_waited_for_but_not_for_ever() {
        let folder = tempfile::tempdir().expect("a folder");
        let log = folder.path().join("a.log");
        std::fs::write(&log, "text").expect("written");
        let reader = File::open(&log).expect("the log");
        flock(&reader, FlockOperation::LockShared).expect("a lock");
        assert!(matches!(rotate(&log, 1, false), Ok(RotationResult::Busy)));
        assert!(matches!(rotate(&log, 1, true), Ok(RotationResult::Done)));
    }
}
