//! Clocks: the base of `ctx.now()`, of the period and of the deadlines of topics.
//!
//! Deadlines of calls and supervision stay on the monotonic clock of the system.

use std::fmt;
use std::ops::{Add, Sub};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

/// A time of a clock, in nanoseconds since its zero: 1970-01-01 for the clock of the system, the
/// source's zero for a simulated one.
///
/// ```
/// use rc_runtime::Time;
/// use std::time::Duration;
///
/// let start = Time::from_nanos(2_000_000_000);
/// let later = start + Duration::from_millis(500);
/// assert_eq!(later - start, Duration::from_millis(500));
/// assert_eq!(start - later, Duration::ZERO);
/// assert_eq!(later.to_string(), "2.500 s");
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Time(u64);

impl Time {
    /// The zero of a clock.
    pub const ZERO: Self = Self(0);

    /// The time of this many nanoseconds.
    pub const fn from_nanos(nanoseconds: u64) -> Self {
        Self(nanoseconds)
    }

    /// The nanoseconds since the zero of the clock.
    pub const fn as_nanos(self) -> u64 {
        self.0
    }

    /// The seconds since the zero of the clock.
    pub fn as_secs_f64(self) -> f64 {
        Duration::from_nanos(self.0).as_secs_f64()
    }
}

impl Add<Duration> for Time {
    type Output = Self;

    /// Stops at the largest time, after 584 years.
    fn add(self, step: Duration) -> Self {
        let step = u64::try_from(step.as_nanos()).unwrap_or(u64::MAX);
        Self(self.0.saturating_add(step))
    }
}

impl Sub for Time {
    type Output = Duration;

    /// The time from `earlier` to this time; zero if that is not earlier.
    fn sub(self, earlier: Self) -> Duration {
        Duration::from_nanos(self.0.saturating_sub(earlier.0))
    }
}

impl fmt::Display for Time {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (seconds, rest) = (self.0 / 1_000_000_000, self.0 % 1_000_000_000);
        write!(f, "{seconds}.{:03} s", rest / 1_000_000)
    }
}

/// Returns the time.
pub trait Clock: fmt::Debug + Send + Sync {
    /// The present time.
    fn now(&self) -> Time;
}

/// The clock of the system: its calendar, as UTC. It may jump when it is set.
#[derive(Clone, Copy, Debug, Default)]
pub struct SystemClock;

impl Clock for SystemClock {
    fn now(&self) -> Time {
        // A calendar before 1970 is as good as one at 1970.
        let since = SystemTime::now()
            .duration_since(UNIX_EPOCH)
            .unwrap_or_default();
        Time::ZERO + since
    }
}

/// A clock that stands until it is set.
///
/// ```
/// use rc_runtime::{Clock, SimulatedClock, Time};
///
/// let clock = SimulatedClock::default();
/// clock.set(Time::from_nanos(5));
/// assert_eq!(clock.now(), Time::from_nanos(5));
/// ```
#[derive(Debug, Default)]
pub struct SimulatedClock(AtomicU64);

impl SimulatedClock {
    /// Sets the time, possibly to an earlier one.
    pub fn set(&self, time: Time) {
        self.0.store(time.as_nanos(), Ordering::Relaxed);
    }
}

impl Clock for SimulatedClock {
    fn now(&self) -> Time {
        Time(self.0.load(Ordering::Relaxed))
    }
}
