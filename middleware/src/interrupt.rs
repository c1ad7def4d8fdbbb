//! What wakes a waiting component: a stop, or a wish of its management.

use rustix::event::{EventfdFlags, eventfd};
use std::io;
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// A descriptor that becomes readable, and whether the component is to stop. Clones are the same interrupt.
#[derive(Clone, Debug)]
pub struct Interrupt(Arc<Inner>);

#[derive(Debug)]
struct Inner {
    event: OwnedFd,
    stopping: AtomicBool,
}

impl Interrupt {
    /// An interrupt at rest.
    pub fn new() -> io::Result<Self> {
        let event = eventfd(0, EventfdFlags::CLOEXEC | EventfdFlags::NONBLOCK)?;
        Ok(Self(Arc::new(Inner {
            event,
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
        // The only failure is a counter that is full, and then the descriptor is readable already.
        let _ = rustix::io::write(&self.0.event, &1_u64.to_ne_bytes());
    }

    /// Takes a wake-up back, unless it is a stop, which stays.
    pub fn clear(&self) {
        if !self.is_stopping() {
            let _ = rustix::io::read(&self.0.event, &mut [0_u8; 8]);
        }
    }
}

impl AsFd for Interrupt {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.0.event.as_fd()
    }
}
