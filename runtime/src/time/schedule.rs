//! The period of `compute()` on a simulated clock.

use crate::clock::Time;
use std::time::Duration;

/// When `compute()` is due. It runs at most once a tick, however far time has moved.
#[derive(Debug, Default)]
pub(crate) struct Schedule {
    /// `None`: at the next tick.
    next: Option<Time>,
}

impl Schedule {
    /// Whether `compute()` is due at `now`; then it schedules the next one and gives the number of
    /// periods that passed without one.
    pub(crate) fn take(&mut self, now: Time, period: Duration) -> Option<u64> {
        let due = self.next.unwrap_or(now);
        if now < due {
            return None;
        }
        let period_ns = u64::try_from(period.as_nanos()).unwrap_or(u64::MAX).max(1);
        let missed = (now - due).as_nanos() / u128::from(period_ns);
        let missed = u64::try_from(missed).unwrap_or(u64::MAX);
        let passed = Duration::from_nanos(period_ns.saturating_mul(missed.saturating_add(1)));
        self.next = Some(due + passed);
        Some(missed)
    }

    /// Starts again at the next tick: time has jumped back, or another source has begun.
    pub(crate) fn restart(&mut self) {
        self.next = None;
    }

    /// The period is another one from `now` on.
    pub(crate) fn set_period(&mut self, now: Time, period: Duration) {
        if self.next.is_some() {
            self.next = Some(now + period);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ms(ms: u64) -> Time {
        Time::from_nanos(ms * 1_000_000)
    }

    #[test]
    fn a_schedule_runs_once_a_period_and_counts_missed_periods() {
        let period = Duration::from_millis(50);
        let mut schedule = Schedule::default();
        let taken =
            [10, 20, 59, 60, 100, 110, 300, 309, 310].map(|at| schedule.take(ms(at), period));
        let expected = [
            Some(0),
            None,
            None,
            Some(0),
            None,
            Some(0),
            Some(2),
            None,
            Some(0),
        ];
        assert_eq!(taken, expected);
        schedule.restart();
        assert_eq!(schedule.take(ms(3), period), Some(0));
        assert_eq!(schedule.take(ms(52), period), None);
        schedule.set_period(ms(52), Duration::from_millis(10));
        assert_eq!(schedule.take(ms(61), period), None);
        assert_eq!(schedule.take(ms(62), period), Some(0));
    }
}
