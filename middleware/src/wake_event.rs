//! Wakes a component that waits: to stop, or to run a command of its management.

use rustix::event::{EventfdFlags, eventfd};
use std::io;
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// A descriptor that becomes readable, and a request to stop. Clones share one event.
///
/// ```
/// use rc_middleware::{WakeEvent, wait};
/// use std::{os::fd::AsFd, time::Duration};
///
/// let event = WakeEvent::new().expect("a descriptor");
/// event.wake();
/// assert_eq!(wait(&[event.as_fd()], Duration::from_secs(1)), 1);
/// event.clear();
/// assert_eq!(wait(&[event.as_fd()], Duration::ZERO), 0);
/// ```
#[derive(Clone, Debug)]
pub struct WakeEvent(Arc<Inner>);

#[derive(Debug)]
struct Inner {
    event: OwnedFd,
    /// Whether the descriptor is readable, or about to be. It saves a call of the kernel for each
    /// further wake-up.
    awake: AtomicBool,
    stopping: AtomicBool,
}

impl WakeEvent {
    /// A new event, not readable. It fails where no descriptor is left.
    pub fn new() -> io::Result<Self> {
        let event = eventfd(0, EventfdFlags::CLOEXEC | EventfdFlags::NONBLOCK)?;
        Ok(Self(Arc::new(Inner {
            event,
            awake: AtomicBool::new(false),
            stopping: AtomicBool::new(false),
        })))
    }

    /// Requests a stop: every call that waits ends with `Stopping`.
    pub fn stop(&self) {
        self.0.stopping.store(true, Ordering::SeqCst);
        self.0.awake.store(true, Ordering::SeqCst);
        // Even where the descriptor is readable already: an edge-triggered wait sees only a write.
        self.write();
    }

    /// Whether a stop was requested.
    pub fn is_stopping(&self) -> bool {
        self.0.stopping.load(Ordering::SeqCst)
    }

    /// Makes the descriptor readable.
    pub fn wake(&self) {
        if !self.0.awake.swap(true, Ordering::SeqCst) {
            self.write();
        }
    }

    fn write(&self) {
        // It fails only where the counter is full, and then the descriptor is readable already.
        let _ = rustix::io::write(&self.0.event, &1_u64.to_ne_bytes());
    }

    /// Clears readiness, unless a stop was requested. Look for the reason of the wake-up
    /// afterwards.
    pub fn clear(&self) {
        if self.is_stopping() || !self.0.awake.load(Ordering::SeqCst) {
            return;
        }
        // If nothing can be read yet, another thread is about to write in `wake`.
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

#[cfg(test)]
mod tests {
    use super::*;
    use rustix::event::{Timespec, epoll};
    use std::mem::MaybeUninit;

    /// A client in a call sees only edges. A wake-up before the stop must not hide the stop.
    #[test]
    fn a_stop_after_a_wake_up_is_an_edge_of_its_own() {
        let event = WakeEvent::new().expect("a descriptor");
        let set = epoll::create(epoll::CreateFlags::CLOEXEC).expect("a set");
        let edges = epoll::EventFlags::IN | epoll::EventFlags::ET;
        epoll::add(&set, &event, epoll::EventData::new_u64(0), edges).expect("to add");
        let edges = || {
            let mut events = [MaybeUninit::uninit(); 1];
            let (events, _) =
                epoll::wait(&set, &mut events, Some(&Timespec::default())).expect("events");
            events.len()
        };
        event.wake();
        assert_eq!(edges(), 1);
        event.wake();
        assert_eq!(edges(), 0);
        event.stop();
        assert_eq!(edges(), 1);
        event.clear();
        assert_eq!(crate::wait(&[event.as_fd()], std::time::Duration::ZERO), 1);
    }
}
