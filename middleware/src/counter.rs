//! A number that one thread counts up and others read.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// How many values a topic has sent, or how many calls a caller has made.
#[derive(Clone, Debug, Default)]
pub struct Counter(Arc<AtomicU64>);

impl Counter {
    /// The number by now.
    pub fn get(&self) -> u64 {
        self.0.load(Ordering::Relaxed)
    }

    /// Counts one more. Only the thread of the sending end does, so that nothing has to be locked.
    pub(crate) fn next(&self) -> u64 {
        let next = self.get() + 1;
        self.0.store(next, Ordering::Relaxed);
        next
    }
}
