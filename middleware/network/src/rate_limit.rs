//! Limits how often the log repeats a report.

use std::sync::Mutex;
use std::time::{Duration, Instant};

/// Least time between two reports of one kind.
const PAUSE: Duration = Duration::from_secs(1);

/// Allows one report a second, and counts the reports in between.
#[derive(Debug, Default)]
pub struct RateLimit(Mutex<State>);

#[derive(Debug)]
struct State {
    last: Option<Instant>,
    suppressed: u64,
}

impl Default for State {
    fn default() -> Self {
        Self::new()
    }
}

impl State {
    const fn new() -> Self {
        Self {
            last: None,
            suppressed: 0,
        }
    }
}

impl RateLimit {
    /// A limit that allows the first report.
    pub const fn new() -> Self {
        Self(Mutex::new(State::new()))
    }

    /// Whether to report now: the number of reports that were suppressed since the last one, or
    /// `None`.
    pub fn allow(&self) -> Option<u64> {
        let mut state = crate::lock(&self.0);
        if state.last.is_some_and(|last| last.elapsed() < PAUSE) {
            state.suppressed += 1;
            return None;
        }
        state.last = Some(Instant::now());
        Some(std::mem::take(&mut state.suppressed))
    }
}
