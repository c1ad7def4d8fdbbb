//! How long an end of a connection polls before it sleeps (`wake spin`).
//!
//! Polling saves a wake-up if both ends have a processor. If they share one, the end that polls
//! keeps the other one from running: a call then takes as long as the polling, or until the kernel
//! takes the processor away. So an end stops polling for some time if a few polls in a row are
//! useless, and tries again at growing intervals. A poll is useless if no message comes, or if one
//! comes while this end is off its processor, which a far longer pause between two looks shows.

use std::cell::Cell;
use std::time::{Duration, Instant};

/// The doubt that a poll without use adds.
const USELESS: u32 = 32;
/// The doubt at which an end stops polling: three polls in a row without use.
const STOP: u32 = 3 * USELESS;
/// How many waits it sleeps at once before the next attempt, at first and at most.
const RESTS: [u32; 2] = [64, 4096];
/// By how much a pause between two looks exceeds the usual one if this end was off its processor.
const AWAY: u32 = 16;

/// The polling of one end.
///
/// ```
/// use rc_middleware::Spin;
/// use std::time::{Duration, Instant};
///
/// let limit = Duration::from_micros(200);
/// let mut spin = Spin::new(limit);
/// for _ in 0..3 {
///     let begin = Instant::now();
///     assert_eq!(spin.begin(begin), limit);
///     spin.looked(begin + limit / 2);
///     spin.in_vain();
/// }
/// assert_eq!(spin.begin(Instant::now()), Duration::ZERO);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Spin {
    limit: Duration,
    /// The evidence against polling, up to [`STOP`].
    doubt: u32,
    /// How many more waits it sleeps at once, and how many after the next useless poll.
    rest: u32,
    next_rest: u32,
    poll: Option<Poll>,
}

/// A poll that has begun.
#[derive(Clone, Copy, Debug)]
struct Poll {
    begin: Instant,
    /// Looks without a message, and the last one of them.
    looks: u32,
    last: Instant,
}

impl Poll {
    /// Whether the message that was found at `now` came while this end was off its processor.
    fn was_away(&self, now: Instant) -> bool {
        let usual = self.last.saturating_duration_since(self.begin) / self.looks.max(1);
        now.saturating_duration_since(self.last) > usual.saturating_mul(AWAY)
    }
}

impl Spin {
    /// Polls at most for `limit`; zero never polls.
    pub fn new(limit: Duration) -> Self {
        Self {
            limit,
            doubt: 0,
            rest: 0,
            next_rest: RESTS[0],
            poll: None,
        }
    }

    /// How long to poll for the next message from `now` on; zero means no polling. Otherwise
    /// [`Spin::looked`] follows for each look without a message, and [`Spin::came`] or
    /// [`Spin::in_vain`] ends the poll.
    pub fn begin(&mut self, now: Instant) -> Duration {
        self.poll = None;
        if self.rest > 0 {
            self.rest -= 1;
            return Duration::ZERO;
        }
        if !self.limit.is_zero() {
            self.poll = Some(Poll {
                begin: now,
                looks: 0,
                last: now,
            });
        }
        self.limit
    }

    /// A look ended at `now` without a message.
    pub fn looked(&mut self, now: Instant) {
        if let Some(poll) = &mut self.poll {
            poll.looks = poll.looks.saturating_add(1);
            poll.last = now;
        }
    }

    /// A look found a message at `now`.
    pub fn came(&mut self, now: Instant) {
        let Some(poll) = self.poll.take() else {
            return;
        };
        if poll.looks == 0 {
            // It had come before this end polled, which says little.
            self.doubt = self.doubt.saturating_sub(1);
        } else if poll.was_away(now) {
            self.was_useless();
        } else {
            self.doubt = 0;
        }
        if self.doubt == 0 {
            self.next_rest = RESTS[0];
        }
    }

    /// The time is over, and no message has come.
    pub fn in_vain(&mut self) {
        if self.poll.take().is_some() {
            self.was_useless();
        }
    }

    /// Calls `look` without sleeping, for the time that this end polls and at most for `limit`,
    /// until it gives a result. `look` sets the time at which it has found a message; a result
    /// without one says nothing about the use of polling.
    ///
    /// ```
    /// use rc_middleware::Spin;
    /// use std::cell::Cell;
    /// use std::time::{Duration, Instant};
    ///
    /// let spin = Cell::new(Spin::new(Duration::from_secs(1)));
    /// let mut looks = 0;
    /// let found = Spin::poll(&spin, Duration::MAX, |found| {
    ///     looks += 1;
    ///     (looks == 3).then(|| *found = Some(Instant::now()))
    /// });
    /// assert_eq!((found, looks), (Some(()), 3));
    /// ```
    pub fn poll<T>(
        end: &Cell<Self>,
        limit: Duration,
        mut look: impl FnMut(&mut Option<Instant>) -> Option<T>,
    ) -> Option<T> {
        let mut spin = end.get();
        let begin = Instant::now();
        let own = spin.begin(begin);
        // A poll that something else ends says nothing.
        end.set(spin);
        let limit = limit.min(own);
        while !limit.is_zero() {
            let mut found = None;
            let result = look(&mut found);
            if result.is_some() {
                if let Some(found) = found {
                    spin.came(found);
                    end.set(spin);
                }
                return result;
            }
            let now = Instant::now();
            if now.saturating_duration_since(begin) >= limit {
                break;
            }
            spin.looked(now);
            std::hint::spin_loop();
        }
        if limit == own {
            spin.in_vain();
            end.set(spin);
        }
        None
    }

    fn was_useless(&mut self) {
        self.doubt = (self.doubt + USELESS).min(STOP);
        if self.doubt == STOP {
            self.rest = self.next_rest;
            self.next_rest = (self.next_rest * 2).min(RESTS[1]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMIT: Duration = Duration::from_micros(400);
    const LOOK: Duration = Duration::from_nanos(100);

    /// How a poll ends.
    #[derive(Clone, Copy, Debug, PartialEq)]
    enum End {
        /// The message is there at the first look.
        AtOnce,
        /// After some looks.
        Between,
        /// While the other end has this end's processor.
        Away,
        Vain,
    }

    /// The time by which so many waits were longer than without polling, which end in turn as
    /// `ends` say, and the number of those that polled.
    fn polls(spin: &mut Spin, waits: usize, ends: &[End]) -> (Duration, usize) {
        let (mut now, mut spent, mut polled) = (Instant::now(), Duration::ZERO, 0);
        for end in ends.iter().cycle().take(waits) {
            if spin.begin(now).is_zero() {
                continue;
            }
            polled += 1;
            let looks = match end {
                End::AtOnce => 0,
                End::Between => 17,
                End::Away => 2000,
                End::Vain => 4000,
            };
            for _ in 0..looks {
                now += LOOK;
                spin.looked(now);
            }
            match end {
                End::Vain => spin.in_vain(),
                End::Away => spin.came(now + 90 * LOOK),
                End::AtOnce | End::Between => spin.came(now + LOOK),
            }
            if matches!(end, End::Away | End::Vain) {
                spent += LOOK * looks;
            }
        }
        (spent, polled)
    }

    /// Where ends share a processor, polls end in these ways, in whatever order.
    #[test]
    fn polling_costs_ends_that_share_a_processor_less_than_a_fifth_of_a_call() {
        use End::{AtOnce, Away, Vain};
        let orders: [&[End]; 6] = [
            &[Vain],
            &[Away],
            &[Away, Vain],
            &[AtOnce, Vain],
            &[AtOnce, Away],
            &[AtOnce, AtOnce, AtOnce, AtOnce, Vain, AtOnce, Away],
        ];
        for ends in orders {
            let mut spin = Spin::new(LIMIT);
            let (spent, _) = polls(&mut spin, 10_000, ends);
            // A call takes 9 µs without polling.
            let most = Duration::from_micros(9) * 10_000 / 5;
            assert!(spent <= most, "{ends:?}: {spent:?} of {most:?}");
            let (_, again) = polls(&mut spin, RESTS[1] as usize + 1, &[End::Between]);
            assert!(again >= 1, "{ends:?}: it tries again");
            let (_, on) = polls(&mut spin, 100, &[End::Between]);
            assert_eq!(on, 100, "{ends:?}: and polls on");
        }
    }

    /// Polls that are of use, with a pause of the other end now and then.
    #[test]
    fn ends_with_a_processor_each_keep_polling() {
        use End::{AtOnce, Between, Vain};
        let burst = [&[AtOnce; 40][..], &[Vain]].concat();
        for ends in [&[Between][..], &[Vain, Vain, Between], &[AtOnce], &burst] {
            let mut spin = Spin::new(LIMIT);
            assert_eq!(polls(&mut spin, 3000, ends).1, 3000, "{ends:?}");
        }
        let mut none = Spin::new(Duration::ZERO);
        assert_eq!(polls(&mut none, 100, &[Between]).1, 0);
    }
}
