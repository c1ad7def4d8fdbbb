//! The last versions of something, by their times.

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Duration;

/// Something that has versions.
pub trait Timed {
    /// When the version was made.
    fn time(&self) -> Duration;
}

/// The last versions, the earliest first.
#[derive(Debug)]
pub struct Versions<V> {
    most: usize,
    duration: Duration,
    all: VecDeque<Arc<V>>,
}

impl<V: Timed> Versions<V> {
    /// The first version. At most so many are kept, and none that holds no longer at this duration
    /// before the last one.
    pub fn new(first: Arc<V>, most: usize, duration: Duration) -> Self {
        Self {
            most,
            duration,
            all: VecDeque::from([first]),
        }
    }

    /// Changes the limits of [`new`](Self::new).
    pub fn keep(&mut self, most: usize, duration: Duration) {
        (self.most, self.duration) = (most, duration);
        self.forget();
    }

    /// Drops all of them.
    pub fn clear(&mut self) {
        self.all.clear();
    }

    /// Adds the last version. If the clock was set back, later ones leave.
    pub fn push(&mut self, version: Arc<V>) {
        let time = version.time();
        while self.all.back().is_some_and(|last| last.time() > time) {
            self.all.pop_back();
        }
        self.all.push_back(version);
        self.forget();
    }

    fn forget(&mut self) {
        let Some(now) = self.all.back().map(|last| last.time()) else {
            return;
        };
        let start = now.saturating_sub(self.duration);
        // The version before the start holds at the start.
        while self.all.len() > self.most.max(1)
            || self.all.get(1).is_some_and(|second| second.time() <= start)
        {
            self.all.pop_front();
        }
    }

    /// The time of the first version.
    pub fn start(&self) -> Option<Duration> {
        self.all.front().map(|version| version.time())
    }

    /// The version at a time, and those that follow. `None` before the first one.
    pub fn since(&self, time: Duration) -> Option<impl Iterator<Item = &Arc<V>>> {
        let after = self.all.partition_point(|version| version.time() <= time);
        Some(self.all.range(after.checked_sub(1)?..))
    }
}
