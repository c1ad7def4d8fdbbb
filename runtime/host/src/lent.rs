//! Samples that a publisher has lent: objects of another language may end on any thread, and the
//! sample belongs to that of its publisher.
#![allow(
    unsafe_code,
    reason = "a sample waits for its thread; the block has its argument"
)]

use rc_middleware::LoanedSample;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread::ThreadId;

/// A sample that stays on the thread of its publisher.
pub struct Lent {
    sample: Option<Box<dyn LoanedSample>>,
    thread: ThreadId,
}

// SAFETY: `sample` is used and dropped on `thread` only: `take` and `Drop` compare it, and a sample
// that is dropped elsewhere waits in `ABANDONED` for its thread.
unsafe impl Send for Lent {}

/// Samples whose objects ended on another thread.
static ABANDONED: Mutex<Vec<Lent>> = Mutex::new(Vec::new());
/// Whether a sample may wait. Each function of a worker asks, so it takes no lock.
static ANY: AtomicBool = AtomicBool::new(false);

impl Lent {
    /// A sample of this thread's publisher.
    pub fn new(sample: Box<dyn LoanedSample>) -> Self {
        Self {
            sample: Some(sample),
            thread: std::thread::current().id(),
        }
    }

    /// Whether this is the thread of its publisher.
    pub fn is_here(&self) -> bool {
        self.thread == std::thread::current().id()
    }

    /// Takes the sample, on the thread of its publisher.
    pub fn take(&mut self) -> Option<Box<dyn LoanedSample>> {
        if self.is_here() {
            self.sample.take()
        } else {
            None
        }
    }
}

impl Drop for Lent {
    fn drop(&mut self) {
        if self.sample.is_some() && !self.is_here() {
            let lent = Self {
                sample: self.sample.take(),
                thread: self.thread,
            };
            let mut abandoned = ABANDONED.lock().unwrap_or_else(PoisonError::into_inner);
            abandoned.push(lent);
            ANY.store(true, Ordering::Release);
        }
    }
}

/// Drops the samples of this thread whose objects ended on other threads.
pub fn drop_abandoned() {
    if !ANY.load(Ordering::Acquire) {
        return;
    }
    let own = std::thread::current().id();
    let mut abandoned = ABANDONED.lock().unwrap_or_else(PoisonError::into_inner);
    abandoned.retain(|lent| lent.thread != own);
    ANY.store(!abandoned.is_empty(), Ordering::Release);
}
