//! What wakes a waiting component: a stop, or a wish of its management.

use rustix::event::{EventfdFlags, eventfd};
use std::io;
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// A descriptor that becomes readable, and whether the component is to stop. Clones are the same interrupt.
#[derive(Clone, Debug)]
pub struct WakeEvent(Arc<Inner>);

#[derive(Debug)]
struct Inner {
    event: OwnedFd,
    /// Whether the descriptor is readable, or about to be: what is so already is not asked of the kernel again.
    awake: AtomicBool,
    stopping: AtomicBool,
}

impl WakeEvent {
    /// An interrupt at rest.
    pub fn new() -> io::Result<Self> {
        let event = eventfd(0, EventfdFlags::CLOEXEC | EventfdFlags::NONBLOCK)?;
        Ok(Self(Arc::new(Inner {
            event,
            awake: AtomicBool::new(false),
            stopping: AtomicBool::new(false),
        })))
    }

    /// Asks to stop: every waiting call ends with `Stopping`.
    pub fn stop(&self) {
        self.0.stopping.store(true, Ordering::SeqCst);
        self.wake();
    }

    /// Whether a stop was asked for.
    pub fn is_stopping(&self) -> bool {
        self.0.stopping.load(Ordering::SeqCst)
    }

    /// Makes the descriptor readable.
    pub fn wake(&self) {
        if !self.0.awake.swap(true, Ordering::SeqCst) {
            // The only failure is a counter that is full, and then the descriptor is readable already.
            let _ = rustix::io::write(&self.0.event, &1_u64.to_ne_bytes());
        }
    }

    /// Takes a wake-up back, unless it is a stop, which stays. What was announced before is looked for afterwards.
    pub fn clear(&self) {
        if self.is_stopping() || !self.0.awake.load(Ordering::SeqCst) {
            return;
        }
        // Where nothing can be read yet, who wakes is just about to write.
        if rustix::io::read(&self.0.event, &mut [0_u8; 8]).is_ok() {
            self.0.awake.swap(false, Ordering::SeqCst);
            if self.is_stopping() {
                self.wake();
            }
        }
    }
}

impl AsFd for WakeEvent {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.0.event.as_fd()
    }
}
