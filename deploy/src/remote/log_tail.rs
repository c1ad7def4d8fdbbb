//! Reads the logs of an agent's components in pieces as they grow.
//!
//! The output goes to files, so that a slow connection never blocks a component. Space that was
//! sent is given back to the disk.

use rc_deploy_client::logs;
use rustix::fs::{FallocateFlags, fallocate};
use std::fs::File;
use std::io;
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};

/// The size of a piece in bytes. As JSON, it fits into a line of the protocol.
const PIECE: usize = 8 * 1024;
/// How many bytes are sent before their space is given back.
const BLOCK: u64 = 1 << 20;

/// The log of one component.
#[derive(Debug)]
pub(crate) struct LogTail {
    path: PathBuf,
    file: File,
    sent: u64,
    given_back: u64,
}

impl LogTail {
    /// An empty log.
    pub(crate) fn new(directory: &Path, name: &str) -> io::Result<Self> {
        let path = logs::file(directory, name);
        logs::clear(&path)?;
        let file = File::options().read(true).write(true).open(&path)?;
        Ok(Self {
            path,
            file,
            sent: 0,
            given_back: 0,
        })
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// The next piece. `None` if everything was sent.
    pub(crate) fn next(&mut self) -> Option<String> {
        let mut buffer = [0; PIECE];
        let count = self.file.read_at(&mut buffer, self.sent).unwrap_or(0);
        let whole = &buffer[..whole(&buffer[..count])];
        self.sent += whole.len() as u64;
        if self.sent >= self.given_back + BLOCK {
            // If the file system does not support this, the log keeps everything.
            let hole = FallocateFlags::PUNCH_HOLE | FallocateFlags::KEEP_SIZE;
            let _ = fallocate(&self.file, hole, 0, self.sent);
            self.given_back = self.sent;
        }
        (!whole.is_empty()).then(|| String::from_utf8_lossy(whole).into_owned())
    }

    /// Removes the log, which was sent completely.
    pub(crate) fn remove(self) {
        let _ = std::fs::remove_file(&self.path);
    }
}

/// The length without an incomplete character at the end.
pub(super) fn whole(bytes: &[u8]) -> usize {
    let start = bytes.len().saturating_sub(3);
    for (at, byte) in bytes.iter().enumerate().skip(start).rev() {
        let length = match byte {
            0xF0..=0xF7 => 4,
            0xE0..=0xEF => 3,
            0xC0..=0xDF => 2,
            0x80..=0xBF => continue,
            _ => 1,
        };
        if at + length > bytes.len() {
            return at;
        }
        break;
    }
    bytes.len()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    #[test]
    fn characters_are_sent_whole() {
        let folder = tempfile::tempdir().expect("a folder");
        let mut printed = LogTail::new(folder.path(), "a").expect("a log");
        assert_eq!(printed.next(), None);
        let mut log = File::options()
            .append(true)
            .open(printed.path())
            .expect("the log");
        log.write_all("one\nzw\u{f6}".as_bytes().split_last().expect("bytes").1)
            .expect("written");
        assert_eq!(printed.next().as_deref(), Some("one\nzw"));
        log.write_all(b"\xb6lf\n\xff").expect("written");
        assert_eq!(printed.next().as_deref(), Some("\u{f6}lf\n\u{fffd}"));
        let long = "\u{20ac}".repeat(BLOCK as usize);
        log.write_all(long.as_bytes()).expect("written");
        let mut all = String::new();
        while let Some(piece) = printed.next() {
            assert!(piece.len() <= PIECE);
            all.push_str(&piece);
        }
        assert!(all == long);
    }
}
