//! The clock of a recording. A step of the system's clock does not tear the recording apart.

use rc_mcap::system_time;
use rustix::time::{ClockId, clock_gettime};

/// A smaller difference between the two clocks is not a step, in nanoseconds.
const STEP: i128 = 1_000_000_000;

/// Begins at the time of the system, and goes on without steps, also while the machine sleeps.
pub(super) struct RecordingClock {
    /// The time of the system at the beginning, and that of the clock without steps.
    began: (u64, u64),
    /// How far the system's clock was ahead when a step was found last.
    ahead: i128,
}

/// A moment.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Times {
    pub(super) recording: u64,
    pub(super) system: u64,
    /// By how much the clock of the system was set since the last call.
    pub(super) step: Option<i128>,
}

impl RecordingClock {
    pub(super) fn begin() -> Self {
        Self::at(system_time(), steady())
    }

    fn at(system: u64, steady: u64) -> Self {
        Self {
            began: (system, steady),
            ahead: 0,
        }
    }

    pub(super) fn now(&mut self) -> Times {
        self.times(system_time(), steady())
    }

    fn times(&mut self, system: u64, steady: u64) -> Times {
        let (began, steady_then) = self.began;
        let recording = began.saturating_add(steady.saturating_sub(steady_then));
        let ahead = i128::from(system) - i128::from(recording);
        let step = ahead - self.ahead;
        let is_step = step.abs() >= STEP;
        if is_step {
            self.ahead = ahead;
        }
        Times {
            recording,
            system,
            step: is_step.then_some(step),
        }
    }
}

fn steady() -> u64 {
    let time = clock_gettime(ClockId::Boottime);
    let seconds = u64::try_from(time.tv_sec).unwrap_or(0);
    seconds.saturating_mul(1_000_000_000) + u64::try_from(time.tv_nsec).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clock_that_is_set_moves_no_time_of_the_recording() {
        const SECOND: u64 = 1_000_000_000;
        const YEAR: u64 = 365 * 86_400 * SECOND;
        let mut clock = RecordingClock::at(YEAR, 5 * SECOND);
        let mut at = |system, steady| {
            let times = clock.times(system, steady);
            assert_eq!(times.system, system);
            (times.recording - YEAR, times.step)
        };
        assert_eq!(at(YEAR + SECOND, 6 * SECOND), (SECOND, None));
        let year = Some(i128::from(YEAR));
        assert_eq!(at(2 * YEAR + 2 * SECOND, 7 * SECOND), (2 * SECOND, year));
        assert_eq!(at(2 * YEAR + 3 * SECOND, 8 * SECOND), (3 * SECOND, None));
        // Back to 1970.
        let (time, step) = at(0, 9 * SECOND);
        assert_eq!(time, 4 * SECOND);
        assert!(
            step.is_some_and(|step| step < -i128::from(YEAR)),
            "{step:?}"
        );
    }
}
