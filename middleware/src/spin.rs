//! How long an end of a connection polls before it sleeps (`wake spin`).
//!
//! Polling saves a wake-up where both ends have a processor. Where they share one, the end that
//! polls keeps the other one from running: a call then takes as long as the polling. So an end that
//! has polled in vain a few times in a row sleeps at once, and tries again ever more rarely.

use std::time::Duration;

/// After how many vain attempts in a row an end stops polling.
const VAIN: u32 = 3;
/// How many waits it then sleeps at once before the next attempt, at first and at most.
const RESTS: [u32; 2] = [64, 4096];

/// The polling of one end.
///
/// ```
/// use rc_middleware::Spin;
/// use std::time::Duration;
///
/// let limit = Duration::from_micros(200);
/// let mut spin = Spin::new(limit);
/// for _ in 0..3 {
///     assert_eq!(spin.begin(), limit);
///     spin.ended(false);
/// }
/// assert_eq!(spin.begin(), Duration::ZERO);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Spin {
    limit: Duration,
    vain: u32,
    /// How many more waits it sleeps at once, and how many after the next vain attempt.
    rest: u32,
    next_rest: u32,
}

impl Spin {
    /// Polls at most for `limit`; zero never polls.
    pub fn new(limit: Duration) -> Self {
        Self {
            limit,
            vain: 0,
            rest: 0,
            next_rest: RESTS[0],
        }
    }

    /// How long to poll for the next message; zero means not at all. [`Spin::ended`] follows where
    /// it is not zero.
    pub fn begin(&mut self) -> Duration {
        if self.rest > 0 {
            self.rest -= 1;
            return Duration::ZERO;
        }
        self.limit
    }

    /// Notes whether the message came while this end polled.
    pub fn ended(&mut self, came: bool) {
        if came {
            *self = Self::new(self.limit);
            return;
        }
        self.vain += 1;
        if self.vain >= VAIN {
            self.rest = self.next_rest;
            self.next_rest = (self.next_rest * 2).min(RESTS[1]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// How many of so many waits poll, each of them with this result.
    fn polls(spin: &mut Spin, waits: u32, came: bool) -> u32 {
        let polls = (0..waits).filter(|_| {
            let polls = !spin.begin().is_zero();
            if polls {
                spin.ended(came);
            }
            polls
        });
        polls.count() as u32
    }

    #[test]
    fn an_end_that_polls_in_vain_stops_until_that_changes() {
        let mut spin = Spin::new(Duration::from_micros(400));
        assert_eq!(polls(&mut spin, 1000, true), 1000);
        // With 9 µs for a call without polling, 1.2 times that are 1.8 µs more: 0.45 % of 400 µs.
        let vain = polls(&mut spin, 10_000, false);
        assert!((VAIN..=45).contains(&vain), "{vain}");
        let again = polls(&mut spin, RESTS[1] + 1, true);
        assert!(again >= 1, "it tries again");
        assert_eq!(polls(&mut spin, 100, true), 100, "and polls on");
    }

    #[test]
    fn a_few_vain_attempts_change_nothing() {
        let mut spin = Spin::new(Duration::from_micros(400));
        for _ in 0..100 {
            assert_eq!(polls(&mut spin, VAIN - 1, false), VAIN - 1);
            assert_eq!(polls(&mut spin, 1, true), 1);
        }
        let mut none = Spin::new(Duration::ZERO);
        assert_eq!(polls(&mut none, 100, true), 0);
    }
}
