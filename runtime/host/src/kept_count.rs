//! How many samples of each topic the worker keeps.

use rc_middleware::KEPT_SAMPLES;
use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// The numbers of kept samples. A topic is its slot, which may be a member, and its operation.
#[derive(Default)]
pub struct KeptCounts(HashMap<(usize, usize), Arc<AtomicUsize>>);

impl KeptCounts {
    /// The number of a topic.
    pub fn of(&mut self, slot: usize, operation: usize) -> &Arc<AtomicUsize> {
        self.0.entry((slot, operation)).or_default()
    }
}

/// One of the samples of a topic that the worker keeps.
pub struct KeptCount(Arc<AtomicUsize>);

impl KeptCount {
    /// Counts one more, up to the limit: the one that is handled, and those of earlier calls.
    pub fn one(count: &Arc<AtomicUsize>) -> Option<Self> {
        // Only the thread of the worker adds; all threads subtract.
        if count.load(Ordering::Acquire) >= KEPT_SAMPLES {
            return None;
        }
        count.fetch_add(1, Ordering::AcqRel);
        Some(Self(Arc::clone(count)))
    }
}

impl Drop for KeptCount {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::AcqRel);
    }
}
