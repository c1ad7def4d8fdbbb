//! When this machine stood still: a thread sleeps for a moment again and again, and notes when it is
//! woken late. A message that is late because nothing ran has no guilty component.

use rc_middleware::now;
use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError, Weak};
use std::time::Duration;

/// How long the thread sleeps, and how late it has to be woken.
const MOMENT: Duration = Duration::from_millis(20);
const LEAST: i64 = 10_000_000;
/// Most stalls that are remembered: enough for the messages of some seconds on a bad machine.
const MOST: usize = 256;

/// The last stalls: when each began and ended, in nanoseconds of the monotonic clock.
#[derive(Debug, Default)]
pub(super) struct Stalls(VecDeque<(i64, i64)>);

impl Stalls {
    /// Begins to watch, until the result is dropped.
    pub(super) fn watch() -> std::io::Result<Arc<Mutex<Self>>> {
        let stalls = Arc::default();
        let watched = Arc::downgrade(&stalls);
        let thread = std::thread::Builder::new().name("stalls".to_owned());
        thread.spawn(move || watch(&watched))?;
        Ok(stalls)
    }

    /// Adds a stall.
    pub(super) fn add(&mut self, begin: i64, end: i64) {
        if self.0.len() == MOST {
            self.0.pop_front();
        }
        self.0.push_back((begin, end));
    }

    /// How long the machine stood still between these times.
    pub(super) fn during(&self, begin: i64, end: i64) -> i64 {
        let parts = self.0.iter();
        let parts = parts.map(|(from, to)| to.min(&end) - from.max(&begin));
        parts.filter(|part| *part > 0).sum()
    }
}

fn watch(watched: &Weak<Mutex<Stalls>>) {
    let time = || i64::try_from(now()).unwrap_or(i64::MAX);
    let moment = MOMENT.as_nanos() as i64;
    loop {
        let due = time().saturating_add(moment);
        std::thread::sleep(MOMENT);
        let Some(stalls) = watched.upgrade() else {
            return;
        };
        let woken = time();
        if woken.saturating_sub(due) >= LEAST {
            let mut stalls = stalls.lock().unwrap_or_else(PoisonError::into_inner);
            stalls.add(due, woken);
        }
    }
}
