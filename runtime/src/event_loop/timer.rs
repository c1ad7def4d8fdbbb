//! The timer of the period, on the clock of the system.

use rustix::event::Timespec;
use rustix::fd::{AsFd, BorrowedFd};
use rustix::time::{
    Itimerspec, TimerfdClockId, TimerfdFlags, TimerfdTimerFlags, timerfd_create, timerfd_settime,
};
use std::io;
use std::os::fd::OwnedFd;
use std::time::Duration;

/// A timer that is due once a period.
pub(super) struct Timer(OwnedFd);

impl Timer {
    /// A timer that is not set.
    pub(super) fn new() -> io::Result<Self> {
        let flags = TimerfdFlags::CLOEXEC | TimerfdFlags::NONBLOCK;
        Ok(Self(timerfd_create(TimerfdClockId::Monotonic, flags)?))
    }

    /// Becomes readable when the timer is due.
    pub(super) fn descriptor(&self) -> BorrowedFd<'_> {
        self.0.as_fd()
    }

    /// Sets the timer: it is due after `first`, and then once a `period`.
    pub(super) fn set(&self, first: Duration, period: Duration) -> io::Result<()> {
        let spec = |d: Duration| Timespec {
            tv_sec: d.as_secs() as i64,
            tv_nsec: i64::from(d.subsec_nanos()),
        };
        let timing = Itimerspec {
            it_interval: spec(period),
            it_value: spec(first),
        };
        timerfd_settime(&self.0, TimerfdTimerFlags::empty(), &timing)?;
        Ok(())
    }

    /// The number of periods since the last call. `None` if none has passed.
    pub(super) fn take(&self) -> Option<u64> {
        let mut expirations = [0_u8; 8];
        rustix::io::read(&self.0, &mut expirations).ok()?;
        Some(u64::from_ne_bytes(expirations))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rustix::event::{PollFd, PollFlags, poll};

    #[test]
    fn a_timer_counts_the_periods_since_the_last_call() {
        let timer = Timer::new().expect("a timer");
        assert_eq!(timer.take(), None);
        let hour = Duration::from_hours(1);
        timer.set(Duration::from_nanos(1), hour).expect("it is set");
        let mut due = [PollFd::from_borrowed_fd(timer.descriptor(), PollFlags::IN)];
        let limit = Timespec {
            tv_sec: 10,
            tv_nsec: 0,
        };
        assert_eq!(poll(&mut due, Some(&limit)), Ok(1), "it is due");
        assert_eq!(timer.take(), Some(1));
        assert_eq!(timer.take(), None);
    }
}
