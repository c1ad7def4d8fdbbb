//! What is said in the log, and not more than once a second; what of it is kept for who watches the component.

use std::sync::Mutex;
use std::time::{Duration, Instant};

/// Least time between two reports of one kind.
const PAUSE: Duration = Duration::from_secs(1);

/// Reports of one kind: the first one is made, the next ones are counted until a second has passed.
#[derive(Debug, Default)]
pub struct RateLimit(Mutex<State>);

#[derive(Debug)]
struct State {
    last: Option<Instant>,
    passed_over: u64,
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
            passed_over: 0,
        }
    }
}

impl RateLimit {
    /// The first one is made.
    pub const fn new() -> Self {
        Self(Mutex::new(State::new()))
    }

    /// Whether to report now; if so, how many reports were passed over.
    pub fn allow(&self) -> Option<u64> {
        let mut state = crate::lock(&self.0);
        if state.last.is_some_and(|last| last.elapsed() < PAUSE) {
            state.passed_over += 1;
            return None;
        }
        state.last = Some(Instant::now());
        Some(std::mem::take(&mut state.passed_over))
    }
}

/// How many texts are kept; the log has them all.
const KEPT: usize = 64;

/// What was said of ends that do not fit, until somebody takes it.
#[derive(Debug, Default)]
pub struct Mismatches(Mutex<Vec<String>>);

impl Mismatches {
    /// An end that will never be heard, or does harm: it is in the log, too.
    pub fn error(&self, text: String) {
        tracing::error!("{text}");
        self.keep(text);
    }

    /// An end with which less works than was asked for: it is in the log, too.
    pub fn warn(&self, text: String) {
        tracing::warn!("{text}");
        self.keep(text);
    }

    fn keep(&self, text: String) {
        let mut kept = crate::lock(&self.0);
        if kept.len() < KEPT {
            kept.push(text);
        }
    }

    /// Takes what was said since the last time.
    pub fn take(&self) -> Vec<String> {
        std::mem::take(&mut *crate::lock(&self.0))
    }
}
