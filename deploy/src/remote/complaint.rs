//! The errors that ssh prints, and the other machine through it: the end of them is kept.

use rc_diagnostics::foreign::clean_lines;
use std::collections::VecDeque;
use std::fs::File;
use std::io::{self, PipeReader, Read};
use std::os::fd::OwnedFd;
use std::sync::mpsc::{self, Receiver};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// How many bytes are kept: why a connection has ended is said last.
const KEPT: usize = 2000;
/// How long a process that ssh has left may hold the pipe. A busy machine needs some of it to read the rest.
const SETTLE_LIMIT: Duration = Duration::from_secs(2);

/// What is printed to a pipe, of which a thread keeps the end.
#[derive(Debug)]
pub(crate) struct Complaint {
    kept: Arc<Mutex<VecDeque<u8>>>,
    /// Closed after the end of the pipe.
    over: Receiver<()>,
}

impl Complaint {
    /// A complaint, and the standard error of ssh.
    pub(crate) fn new() -> io::Result<(Self, File)> {
        let (reader, writer) = io::pipe()?;
        let kept = Arc::new(Mutex::new(VecDeque::new()));
        let (ended, over) = mpsc::channel();
        let shared = Arc::clone(&kept);
        std::thread::Builder::new()
            .name("complaint".to_owned())
            .spawn(move || {
                keep(reader, &shared);
                drop(ended);
            })?;
        Ok((Self { kept, over }, File::from(OwnedFd::from(writer))))
    }

    /// The text, after ssh has ended.
    pub(crate) fn text(self) -> String {
        let _ = self.over.recv_timeout(SETTLE_LIMIT);
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        shown(kept.make_contiguous(), KEPT)
    }
}

/// What ssh has printed, as a message shows it: at most so many characters.
pub(super) fn shown(printed: &[u8], most: usize) -> String {
    // ssh ends its own lines as a terminal in raw mode needs it.
    let text = String::from_utf8_lossy(printed).replace("\r\n", "\n");
    clean_lines(&text, most)
}

fn keep(mut reader: PipeReader, kept: &Mutex<VecDeque<u8>>) {
    let mut part = [0; 4096];
    while let Ok(count) = reader.read(&mut part) {
        if count == 0 {
            return;
        }
        let mut kept = kept.lock().unwrap_or_else(PoisonError::into_inner);
        kept.extend(&part[..count]);
        let surplus = kept.len().saturating_sub(KEPT);
        kept.drain(..surplus);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    #[test]
    fn the_end_of_a_long_complaint_is_kept() {
        let (complaint, mut errors) = Complaint::new().expect("a pipe");
        let line = "noise\n".repeat(100);
        for _ in 0..1000 {
            errors.write_all(line.as_bytes()).expect("somebody reads");
        }
        errors.write_all(b"Connection refused").expect("written");
        drop(errors);
        let kept = Arc::clone(&complaint.kept);
        let text = complaint.text();
        assert!(text.ends_with("noise\nConnection refused"), "{text}");
        let held = kept.lock().expect("the thread has ended").len();
        assert_eq!(held, KEPT);
    }

    #[test]
    fn a_process_that_holds_the_pipe_does_not_hold_the_text() {
        let (complaint, mut errors) = Complaint::new().expect("a pipe");
        errors.write_all(b"gone\r\nrefused").expect("written");
        let kept = Arc::clone(&complaint.kept);
        while kept.lock().expect("no panic").is_empty() {
            std::thread::yield_now();
        }
        assert_eq!(complaint.text(), "gone\nrefused");
        drop(errors);
    }
}
