//! The log of a component, for a middleware that publishes it.

use std::collections::VecDeque;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::ThreadId;
use std::time::SystemTime;

/// Most bytes of lines that wait in a [`LogQueue`].
const LARGEST: usize = 1 << 20;
/// Most bytes of one line's text; the rest is cut off.
const LONGEST: usize = 1 << 14;

/// The level of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum LogLevel {
    /// Details for developers.
    Debug,
    /// Normal operation.
    Info,
    /// Something does not work as it should.
    Warn,
    /// Something does not work.
    Error,
}

/// One line of the log.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LogLine {
    /// When it was logged.
    pub time: SystemTime,
    /// Severity.
    pub level: LogLevel,
    /// Message, without time and level.
    pub text: String,
    /// The source file; empty if unknown.
    pub file: &'static str,
    /// The module path of the code that logged it.
    pub module: &'static str,
    /// The line in the source file; 0 if unknown.
    pub line: u32,
}

/// Lines of the log that wait to be published. Adding one never waits for the publisher: a line
/// without room is counted and lost.
///
/// ```
/// use rc_middleware::{LogLevel, LogLine, LogQueue};
/// use std::time::SystemTime;
///
/// let queue = LogQueue::default();
/// let line = LogLine {
///     time: SystemTime::UNIX_EPOCH,
///     level: LogLevel::Info,
///     text: "ready".to_owned(),
///     file: "",
///     module: "lidar",
///     line: 0,
/// };
/// queue.push(line.clone());
/// queue.close(true);
/// std::thread::spawn(move || {
///     assert_eq!(queue.next(), Some((line, 0)));
///     assert_eq!(queue.next(), None);
/// })
/// .join()
/// .expect("the thread that publishes");
/// ```
#[derive(Debug, Default)]
pub struct LogQueue {
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Debug, Default)]
struct State {
    lines: VecDeque<LogLine>,
    /// Bytes of the waiting lines.
    size: usize,
    lost: u64,
    is_closed: bool,
    /// The thread that publishes. Its own log lines are not published: they could cause others,
    /// without end.
    publisher: Option<ThreadId>,
}

impl LogQueue {
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Adds a line, unless the queue is closed, full, or read by this thread.
    pub fn push(&self, mut line: LogLine) {
        line.text.truncate(line.text.floor_char_boundary(LONGEST));
        let size = size_of::<LogLine>() + line.text.len();
        let mut state = self.state();
        if state.is_closed || state.publisher == Some(std::thread::current().id()) {
            return;
        }
        if state.size + size > LARGEST {
            state.lost += 1;
            return;
        }
        state.size += size;
        state.lines.push_back(line);
        drop(state);
        self.changed.notify_one();
    }

    /// Waits for the next line, on the thread that publishes. The number counts the lines that were
    /// lost since the previous one. `None` after the queue has been closed and is empty.
    pub fn next(&self) -> Option<(LogLine, u64)> {
        let mut state = self.state();
        state.publisher = Some(std::thread::current().id());
        loop {
            if let Some(line) = state.lines.pop_front() {
                state.size -= size_of::<LogLine>() + line.text.len();
                return Some((line, std::mem::take(&mut state.lost)));
            }
            if state.is_closed {
                return None;
            }
            let woken = self.changed.wait(state);
            state = woken.unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Whether the queue refuses further lines.
    pub fn is_closed(&self) -> bool {
        self.state().is_closed
    }

    /// Refuses further lines. Those that wait stay for `next`, if `keep`.
    pub fn close(&self, keep: bool) {
        let mut state = self.state();
        state.is_closed = true;
        if !keep {
            *state = State {
                is_closed: true,
                ..State::default()
            };
        }
        drop(state);
        self.changed.notify_one();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(text: &str) -> LogLine {
        LogLine {
            time: SystemTime::UNIX_EPOCH,
            level: LogLevel::Info,
            text: text.to_owned(),
            file: "",
            module: "",
            line: 0,
        }
    }

    #[test]
    fn a_full_queue_counts_what_it_loses() {
        let queue = LogQueue::default();
        let text = "ä".repeat(LONGEST);
        for _ in 0..2 * LARGEST / LONGEST {
            queue.push(line(&text));
        }
        let (first, lost) = queue.next().expect("a line");
        assert_eq!(first.text.len(), LONGEST);
        let kept = 2 * LARGEST / LONGEST - usize::try_from(lost).expect("a number");
        assert!((LARGEST / LONGEST - 2..=LARGEST / LONGEST).contains(&kept));
        queue.close(true);
        queue.push(line("late"));
        let rest = std::iter::from_fn(|| queue.next());
        assert!(
            rest.map(|(line, lost)| (line.text, lost))
                .eq(std::iter::repeat_n((first.text, 0), kept - 1))
        );
    }

    #[test]
    fn the_publisher_publishes_nothing_of_its_own() {
        let queue = LogQueue::default();
        assert!(!queue.is_closed());
        queue.push(line("first"));
        assert!(queue.next().is_some());
        queue.push(line("about the first"));
        std::thread::scope(|scope| {
            scope.spawn(|| queue.push(line("second")));
        });
        assert_eq!(queue.next().expect("a line").0.text, "second");
        queue.close(false);
        assert!(queue.is_closed());
        assert_eq!(queue.next(), None);
    }
}
