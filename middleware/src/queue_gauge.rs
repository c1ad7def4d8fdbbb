//! Level of a receive queue, for the status of its component.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// The use of the receive queues of one port. The threads that fill and empty the queues update it,
/// others read it.
///
/// ```
/// use rc_middleware::QueueGauge;
///
/// let gauge = QueueGauge::new(1000);
/// assert!(gauge.add(900));
/// assert!(!gauge.add(200), "there is room for 100 bytes");
/// gauge.remove(900);
/// assert_eq!((gauge.bytes(), gauge.dropped()), (0, 1));
/// ```
#[derive(Clone, Debug)]
pub struct QueueGauge(Arc<State>);

#[derive(Debug)]
struct State {
    limit: u64,
    bytes: AtomicU64,
    dropped: AtomicU64,
}

impl QueueGauge {
    /// The gauge of an empty queue with room for `limit` bytes.
    pub fn new(limit: u64) -> Self {
        Self(Arc::new(State {
            limit,
            bytes: AtomicU64::new(0),
            dropped: AtomicU64::new(0),
        }))
    }

    /// The most bytes that wait.
    pub fn limit(&self) -> u64 {
        self.0.limit
    }

    /// The bytes that wait.
    pub fn bytes(&self) -> u64 {
        self.0.bytes.load(Ordering::Relaxed)
    }

    /// The number of samples that were dropped instead of queued: there was no room, or no request
    /// for them.
    pub fn dropped(&self) -> u64 {
        self.0.dropped.load(Ordering::Relaxed)
    }

    /// Adds `size` bytes if there is room for them, else counts a dropped sample.
    pub fn add(&self, size: usize) -> bool {
        let size = size as u64;
        let fits = |bytes: u64| {
            let more = bytes.checked_add(size)?;
            (more <= self.0.limit).then_some(more)
        };
        let bytes = &self.0.bytes;
        let added = bytes.fetch_update(Ordering::Relaxed, Ordering::Relaxed, fits);
        if added.is_err() {
            self.drop_one();
        }
        added.is_ok()
    }

    /// Counts `size` bytes less, that were added before.
    pub fn remove(&self, size: usize) {
        self.0.bytes.fetch_sub(size as u64, Ordering::Relaxed);
    }

    /// Counts a dropped sample.
    pub fn drop_one(&self) {
        self.0.dropped.fetch_add(1, Ordering::Relaxed);
    }
}
