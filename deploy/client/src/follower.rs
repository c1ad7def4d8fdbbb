//! Follows a log as it grows, across rotations.

use crate::log_parts::Header;
use rc_diagnostics::foreign::clean_to;
use rc_management::lines::{LIMIT, Line, Lines, Overlong};
use rustix::fs::{FlockOperation, flock};
use rustix::io::Errno;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// How many bytes at the end of a log are searched for its last lines.
const TAIL: u64 = 256 * 1024;
/// How many bytes are read of one log before the next log.
const TURN: usize = 256 * 1024;

/// How long to wait for a rotation, and how often.
const MOMENT: Duration = Duration::from_millis(1);
const MOMENTS: u32 = 50;

/// A log and the position of its reader.
#[derive(Debug)]
pub struct Follower {
    path: PathBuf,
    file: File,
    position: u64,
    lines: Lines,
    /// How many parts were rotated out before the present one.
    part: u64,
    /// The rest of an older part that is still to be read.
    older: Option<File>,
}

impl Follower {
    /// Opens a log at the beginning of its present part.
    pub fn open(path: &Path) -> io::Result<Self> {
        let file = File::open(path)?;
        let _lock = Lock::of(&file);
        let part = Header::of(path).map_or(0, |(header, _)| header.part);
        Ok(Self {
            path: path.to_owned(),
            file: file.try_clone()?,
            position: 0,
            lines: Lines::new(Overlong::Split),
            part,
            older: None,
        })
    }

    /// Opens a log at its end. Returns at most `count` of its last lines.
    pub fn at_last_lines(path: &Path, count: usize) -> io::Result<(Vec<String>, Self)> {
        let mut follower = Self::open(path)?;
        let skipped = follower.begin(TAIL)?;
        let mut lines = Vec::new();
        follower.read_whole(&mut |line| lines.push(line))?;
        // If something was skipped, the first line is incomplete.
        let first = usize::from(skipped > 0).max(lines.len().saturating_sub(count));
        Ok((lines.split_off(first.min(lines.len())), follower))
    }

    /// Opens a log at its end, after `each` has seen all its lines.
    pub(crate) fn after_all_lines(path: &Path, each: &mut dyn FnMut(String)) -> io::Result<Self> {
        let mut follower = Self::open(path)?;
        follower.begin(u64::MAX)?;
        follower.read_whole(each)?;
        Ok(follower)
    }

    /// Goes back so far that at most `most` bytes of both parts follow. Returns how many bytes
    /// precede them.
    fn begin(&mut self, most: u64) -> io::Result<u64> {
        let length = self.file.metadata()?.len();
        let mut skipped = length.saturating_sub(most);
        self.position = self.file.seek(SeekFrom::Start(skipped))?;
        if skipped == 0
            && let Some((header, mut file)) = Header::of(&self.path)
        {
            let begin = file.metadata()?.len().saturating_sub(most - length);
            let begin = file.seek(SeekFrom::Start(begin.max(header.length)))?;
            skipped = begin - header.length + header.left_out;
            self.older = Some(file);
        }
        Ok(skipped)
    }

    /// Reads what the log has now, up to its last byte.
    fn read_whole(&mut self, each: &mut dyn FnMut(String)) -> io::Result<()> {
        let length = self.file.metadata()?.len();
        while self.older.is_some() || self.position < length {
            let (before, more) = (self.position, self.older.is_some());
            self.read().0.into_iter().for_each(&mut *each);
            if self.position == before && !more {
                break;
            }
        }
        self.finish().into_iter().for_each(each);
        Ok(())
    }

    /// Reads new lines. Returns whether more can be read at once.
    pub fn read(&mut self) -> (Vec<String>, bool) {
        let mut lines = Vec::new();
        if self.older.is_none()
            && let Some(text) = self.turn_over()
        {
            lines.push(text);
        }
        let mut buffer = Vec::new();
        if let Some(older) = &mut self.older {
            let read = older.take(TURN as u64).read_to_end(&mut buffer);
            if read.unwrap_or(0) < TURN {
                self.older = None;
            }
            lines.extend(self.lines.push(&buffer).into_iter().filter_map(printed));
            return (lines, true);
        }
        let read = (&mut self.file).take(TURN as u64).read_to_end(&mut buffer);
        self.position += buffer.len() as u64;
        lines.extend(self.lines.push(&buffer).into_iter().filter_map(printed));
        (lines, read.is_ok_and(|count| count == TURN))
    }

    /// Notices a rotation. The text is about a part that cannot be read any more.
    fn turn_over(&mut self) -> Option<String> {
        // The lock prevents a rotation meanwhile.
        let _lock = Lock::of(&self.file);
        let older = Header::of(&self.path);
        let part = older.as_ref().map_or(0, |(header, _)| header.part);
        let length = self.file.metadata().map_or(0, |file| file.len());
        if part == self.part && length >= self.position {
            return None;
        }
        let rest = older.filter(|_| part > self.part);
        let before = std::mem::replace(&mut self.part, part);
        let position = std::mem::take(&mut self.position);
        let _ = (&self.file).seek(SeekFrom::Start(0));
        let Some((header, mut file)) = rest else {
            // It was emptied, for a new start or because the disk is full.
            self.lines = Lines::new(Overlong::Split);
            return None;
        };
        let known = if part == before + 1 { position } else { 0 };
        let begin = header.length + known.saturating_sub(header.left_out);
        let _ = file.seek(SeekFrom::Start(begin));
        self.older = Some(file);
        let gone = part > before + 1 || known < header.left_out;
        gone.then(|| {
            self.lines = Lines::new(Overlong::Split);
            "[rcdeploy: a part of this log was lost]".to_owned()
        })
    }

    /// Returns the last line if it has no line end.
    pub fn finish(&mut self) -> Option<String> {
        self.lines.finish().and_then(printed)
    }
}

/// A printed line for messages and terminals; the log itself keeps its bytes.
fn printed(line: Line) -> Option<String> {
    Some(clean_to(&line.into_text()?, LIMIT))
}

/// Prevents the rotation of a log while it exists.
struct Lock<'f>(&'f File);

impl<'f> Lock<'f> {
    /// A rotation takes a moment. Without a lock, a line at the border may be lost or read twice.
    fn of(file: &'f File) -> Self {
        for _ in 0..MOMENTS {
            if flock(file, FlockOperation::NonBlockingLockShared) != Err(Errno::WOULDBLOCK) {
                break;
            }
            std::thread::sleep(MOMENT);
        }
        Self(file)
    }
}

impl Drop for Lock<'_> {
    fn drop(&mut self) {
        let _ = flock(self.0, FlockOperation::Unlock);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_terminal_obeys_no_printed_line() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.log");
        std::fs::write(&path, "\u{1b}[2Jgone\rforged\n\u{202e}x").expect("written");
        let (lines, _) = Follower::at_last_lines(&path, 2).expect("read");
        assert_eq!(lines, ["\\u{1b}[2Jgone\\rforged", "\\u{202e}x"]);
    }

    #[test]
    fn a_log_is_followed_after_truncation() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.log");
        std::fs::write(&path, "one\ntwo\nthr").expect("written");
        assert_eq!(
            Follower::at_last_lines(&path, 2).expect("read").0,
            ["two", "thr"]
        );
        let mut follower = Follower::open(&path).expect("opened");
        assert_eq!(follower.read().0, ["one", "two"]);
        std::fs::write(&path, "new\n").expect("written");
        assert_eq!(follower.read().0, ["new"]);
        assert_eq!(follower.finish(), None);
    }

    #[test]
    fn a_log_is_followed_across_its_rotation() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.log");
        let turn = |part: u64, left_out: u64, text: &str| {
            let header = format!(
                "[rcdeploy: part {part} of this log, without its first {left_out} bytes]\n"
            );
            std::fs::write(folder.path().join("a.log.1"), header + text).expect("written");
        };
        std::fs::write(&path, "one\ntwo\nthr").expect("written");
        let mut follower = Follower::open(&path).expect("opened");
        assert_eq!(
            follower.read(),
            (vec!["one".to_owned(), "two".to_owned()], false)
        );
        turn(1, 0, "one\ntwo\nthree\n");
        std::fs::write(&path, "four\n").expect("written");
        assert_eq!(follower.read().0, ["three"]);
        assert_eq!(follower.read(), (vec!["four".to_owned()], false));
        // Both parts are one log.
        let tail = |count| Follower::at_last_lines(&path, count).expect("read").0;
        assert_eq!(tail(3), ["two", "three", "four"]);
        assert_eq!(tail(9), ["one", "two", "three", "four"]);
        // A line that began before the border ends after it, even if the log has grown again
        // meanwhile.
        std::fs::write(&path, "four\nfi").expect("written");
        assert_eq!(follower.read().0, [""; 0]);
        turn(2, 0, "four\nfi");
        std::fs::write(&path, "ve\nand much more\n").expect("written");
        assert_eq!(follower.read().0, [""; 0]);
        assert_eq!(follower.read().0, ["five", "and much more"]);
        // Components whose logs were removed are reported.
        turn(4, 7, "eight\n");
        std::fs::write(&path, "nine\n").expect("written");
        assert_eq!(
            follower.read().0,
            ["[rcdeploy: a part of this log was lost]", "eight"]
        );
        assert_eq!(follower.read().0, ["nine"]);
    }

    #[test]
    fn only_the_end_of_a_long_log_is_read() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.log");
        let lines: Vec<String> = (0..100_000).map(|i| format!("line {i}")).collect();
        std::fs::write(&path, lines.join("\n")).expect("written");
        assert_eq!(
            Follower::at_last_lines(&path, 2).expect("read").0,
            ["line 99998", "line 99999"]
        );
    }
}
