//! A counter that one thread increments and others read.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// The number of samples that a publisher has sent, or of requests that a client has sent.
#[derive(Clone, Debug, Default)]
pub struct Counter(Arc<AtomicU64>);

impl Counter {
    /// The current count.
    pub fn get(&self) -> u64 {
        self.0.load(Ordering::Relaxed)
    }

    /// Increments and gives the new count. Only one thread may call it, so it needs no lock.
    pub fn next(&self) -> u64 {
        let next = self.get() + 1;
        self.0.store(next, Ordering::Relaxed);
        next
    }
}
