//! What a host prints while it compares sources and builds. A host that prints without end, or nothing
//! new for long, ends the build.

use super::lost;
use crate::remote::timed_stream::TimedStream;
use std::collections::VecDeque;
use std::io::{BufRead, BufReader};
use std::time::{Duration, Instant};

/// The most bytes that a host may print.
const MOST: u64 = 64 << 20;
/// How long a host may print nothing new: one large crate takes many minutes on a small computer.
const PATIENCE: Duration = Duration::from_hours(1);
/// The length at which a line is cut into parts.
const LINE: usize = 64 << 10;
/// How many lines are kept: they explain a failure, and a line is new that is none of them.
const KEPT: usize = 60;

/// The output of a host, line by line.
pub(super) struct Output {
    pub(super) input: BufReader<TimedStream>,
    /// How many bytes may still come.
    pub(super) left: u64,
    pub(super) patience: Duration,
    /// When the last new line came.
    since: Instant,
    last: VecDeque<String>,
}

impl Output {
    pub(super) fn new(stream: TimedStream) -> Self {
        Self {
            input: BufReader::new(stream),
            left: MOST,
            patience: PATIENCE,
            since: Instant::now(),
            last: VecDeque::new(),
        }
    }

    /// The next line, without its end.
    ///
    /// # Errors
    /// The connection has ended, or a limit is reached; for people.
    pub(super) fn line(&mut self) -> Result<String, String> {
        let mut line = Vec::new();
        loop {
            let came = self.input.fill_buf().map_err(|error| lost(&error))?;
            if came.is_empty() {
                return Err(super::LOST.to_owned());
            }
            let end = came.iter().position(|byte| *byte == b'\n');
            let count = end.map_or(came.len(), |at| at + 1).min(LINE);
            line.extend_from_slice(&came[..count]);
            self.input.consume(count);
            self.left = self.left.saturating_sub(count as u64);
            if self.left == 0 {
                return Err(format!(
                    "it has printed {} MiB, and its build was ended; a build prints less",
                    MOST >> 20
                ));
            }
            if self.since.elapsed() >= self.patience {
                return Err(format!(
                    "it has printed nothing new for {} minutes, and its build was ended; the next `rcdeploy up --build` goes on where \
                     it was",
                    self.patience.as_secs() / 60
                ));
            }
            if line.pop_if(|last| *last == b'\n').is_some() || line.len() >= LINE {
                return Ok(String::from_utf8_lossy(&line).into_owned());
            }
        }
    }

    /// Counts the time anew, for the next step.
    pub(super) fn begin(&mut self) {
        self.since = Instant::now();
    }

    /// Keeps a line of cargo.
    pub(super) fn keep(&mut self, text: String) {
        if !self.last.contains(&text) {
            self.since = Instant::now();
        }
        if self.last.len() == KEPT {
            self.last.pop_front();
        }
        self.last.push_back(text);
    }

    /// Whether one of the last lines of cargo contains a text.
    pub(super) fn has(&self, text: &str) -> bool {
        self.last.iter().any(|line| line.contains(text))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::fd::OwnedFd;
    use std::os::unix::net::UnixStream;

    #[test]
    fn a_line_that_comes_again_is_no_progress() {
        let (stream, _other) = UnixStream::pair().expect("a pair");
        let mut output = Output::new(TimedStream(OwnedFd::from(stream)));
        let begun = output.since;
        output.keep("warning: a".to_owned());
        let first = output.since;
        assert!(first > begun);
        output.keep("warning: a".to_owned());
        assert_eq!(output.since, first);
        output.keep("warning: b".to_owned());
        assert!(output.since > first);
    }
}
