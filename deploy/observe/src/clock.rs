//! How far the clocks of another machine are ahead of those of this one, as NTP estimates it
//! (RFC 5905): half of a round trip before the answer, the other machine had read its clocks.

use crate::error::Error;
use crate::network::{connect, failed};
use rc_management::Client;
use rc_management::component::Request;
use rc_management::observation::Clocks;
use rc_middleware::now;
use std::collections::VecDeque;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

/// How long a component may take to tell its clocks.
const LIMIT: Duration = Duration::from_secs(3);
/// The round trips of the first estimate.
const AT_FIRST: usize = 8;
/// The round trips that are kept. The fastest one decides.
const KEPT: usize = 32;
/// The part by which two clocks may drift apart: PHI of RFC 5905, 15 µs in a second.
const DRIFT_PER_MILLION: u64 = 15;

/// A clock of a machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MachineClock {
    /// The clock of the system, by which DDS stamps samples.
    System,
    /// The monotonic clock, by which shared memory stamps them.
    Monotonic,
}

/// How far a clock of another machine is ahead of this machine's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Offset {
    /// Nanoseconds; negative if it is behind.
    pub ahead_ns: i64,
    /// The greatest error, in nanoseconds, if the clocks drift as much as RFC 5905 assumes: half
    /// of the round trip, and 15 µs for each second since then.
    pub uncertainty_ns: u64,
}

/// Estimates the clocks of the machine of a component, over its management socket.
pub struct RemoteClock {
    component: String,
    client: Client,
    exchanges: VecDeque<Exchange>,
}

/// A round trip, in nanoseconds.
#[derive(Clone, Copy, Debug)]
struct Exchange {
    /// The time of the answer by the monotonic clock of this machine.
    at: u64,
    round_trip: u64,
    system_ahead: i64,
    monotonic_ahead: i64,
}

impl RemoteClock {
    /// Connects to a component, and estimates its clocks by several round trips.
    pub fn new(network: &str, component: &str) -> Result<Self, Error> {
        let mut clock = Self {
            component: component.to_owned(),
            client: connect(network, component, LIMIT)?,
            exchanges: VecDeque::new(),
        };
        for _ in 0..AT_FIRST {
            clock.measure()?;
        }
        Ok(clock)
    }

    /// The component whose machine it is.
    pub fn component(&self) -> &str {
        &self.component
    }

    /// Makes another round trip: repeat it, since clocks drift.
    pub fn measure(&mut self) -> Result<(), Error> {
        let begin = now();
        let asked = self.client.call(&Request::Clocks, LIMIT);
        // In this order, a pause between the two counts as part of the round trip.
        let system = system_time();
        let at = now();
        let theirs: Clocks = asked.map_err(|error| failed(&self.component, &error))?;
        let exchange = Exchange::new(begin, (at, system), theirs);
        keep(&mut self.exchanges, exchange);
        Ok(())
    }

    /// The present estimate.
    pub fn offset(&self, clock: MachineClock) -> Offset {
        best(&self.exchanges, clock, now())
    }
}

/// Nanoseconds since 1970.
fn system_time() -> i64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    let ns = since.map(|since| since.as_nanos()).unwrap_or_default();
    i64::try_from(ns).unwrap_or(i64::MAX)
}

/// `a - b`, limited to the range of the type: the clocks of strangers may say anything.
fn difference(a: i64, b: i64) -> i64 {
    a.saturating_sub(b)
}

fn signed(ns: u64) -> i64 {
    i64::try_from(ns).unwrap_or(i64::MAX)
}

impl Exchange {
    /// `begin` and the times of the answer, monotonic and of the system, are of this machine.
    fn new(begin: u64, (at, system): (u64, i64), theirs: Clocks) -> Self {
        let round_trip = at.saturating_sub(begin);
        let half = signed(round_trip / 2);
        Self {
            at,
            round_trip,
            system_ahead: difference(theirs.system_ns, difference(system, half)),
            monotonic_ahead: difference(signed(theirs.monotonic_ns), difference(signed(at), half)),
        }
    }

    fn offset(&self, clock: MachineClock, now: u64) -> Offset {
        let since = now.saturating_sub(self.at);
        let drift = since / 1_000_000 * DRIFT_PER_MILLION;
        Offset {
            ahead_ns: match clock {
                MachineClock::System => self.system_ahead,
                MachineClock::Monotonic => self.monotonic_ahead,
            },
            uncertainty_ns: self.round_trip.div_ceil(2).saturating_add(drift),
        }
    }
}

/// Adds an exchange. If it contradicts earlier ones, a clock was set, or a machine was started
/// again, and they say nothing any more.
fn keep(exchanges: &mut VecDeque<Exchange>, new: Exchange) {
    for clock in [MachineClock::System, MachineClock::Monotonic] {
        let present = new.offset(clock, new.at);
        exchanges.retain(|exchange| {
            let earlier = exchange.offset(clock, new.at);
            let apart = earlier.ahead_ns.abs_diff(present.ahead_ns);
            apart
                <= earlier
                    .uncertainty_ns
                    .saturating_add(present.uncertainty_ns)
        });
    }
    if exchanges.len() >= KEPT {
        exchanges.pop_front();
    }
    exchanges.push_back(new);
}

/// The estimate with the smallest uncertainty. Nothing is known without an exchange.
fn best(exchanges: &VecDeque<Exchange>, clock: MachineClock, now: u64) -> Offset {
    let offsets = exchanges.iter().map(|exchange| exchange.offset(clock, now));
    let unknown = Offset {
        ahead_ns: 0,
        uncertainty_ns: u64::MAX,
    };
    offsets
        .min_by_key(|offset| offset.uncertainty_ns)
        .unwrap_or(unknown)
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;
    const SECOND: u64 = 1000 * MS;
    /// How far the other machine is ahead: its system by five seconds, and it started 1000 s later.
    const AHEAD: [i64; 2] = [5 * SECOND as i64, -1000 * SECOND as i64];

    /// A round trip that begins at `begin` by our monotonic clock, and takes so long in each
    /// direction.
    fn exchange(begin: u64, there: u64, back: u64, ahead: [i64; 2]) -> Exchange {
        let system = |at: u64| 1_700_000_000 * SECOND as i64 + at as i64;
        let theirs = Clocks {
            system_ns: system(begin + there) + ahead[0],
            monotonic_ns: u64::try_from((begin + there) as i64 + ahead[1]).expect("a time"),
        };
        let at = begin + there + back;
        Exchange::new(begin, (at, system(at)), theirs)
    }

    fn of(exchanges: impl IntoIterator<Item = Exchange>) -> VecDeque<Exchange> {
        let mut kept = VecDeque::new();
        for exchange in exchanges {
            keep(&mut kept, exchange);
        }
        kept
    }

    #[test]
    fn the_fastest_round_trip_decides_and_bounds_its_error() {
        let begin = 5000 * SECOND;
        let exchanges = of([
            exchange(begin, 40 * MS, MS, AHEAD),
            exchange(begin + 50 * MS, 2 * MS, MS, AHEAD),
            exchange(begin + 90 * MS, MS, 30 * MS, AHEAD),
        ]);
        assert_eq!(exchanges.len(), 3);
        let clocks = [MachineClock::System, MachineClock::Monotonic];
        for (clock, ahead) in clocks.into_iter().zip(AHEAD) {
            let offset = best(&exchanges, clock, begin + 53 * MS);
            assert_eq!(offset.uncertainty_ns, 3 * MS / 2);
            assert_eq!(offset.ahead_ns - ahead, MS as i64 / 2);
            // Two seconds later, the clocks may have drifted apart.
            let later = best(&exchanges, clock, begin + 53 * MS + 2 * SECOND);
            assert_eq!(later.uncertainty_ns, 3 * MS / 2 + 30_000);
        }
    }

    #[test]
    fn a_clock_that_was_set_is_estimated_anew() {
        let begin = 5000 * SECOND;
        let fast = exchange(begin, MS / 10, MS / 10, AHEAD);
        let set = [AHEAD[0] - SECOND as i64, AHEAD[1]];
        let slow = exchange(begin + SECOND, 3 * MS, 3 * MS, set);
        let exchanges = of([fast, slow]);
        let offset = best(&exchanges, MachineClock::System, begin + 2 * SECOND);
        assert_eq!(offset.ahead_ns, set[0]);
        let many = (0..100).map(|count| exchange(begin + count * SECOND, MS, MS, AHEAD));
        assert_eq!(of(many).len(), KEPT);
    }

    #[test]
    fn impossible_clocks_are_numbers_too() {
        let theirs = Clocks {
            system_ns: i64::MIN,
            monotonic_ns: u64::MAX,
        };
        let exchange = Exchange::new(10, (5, i64::MAX), theirs);
        assert_eq!(exchange.round_trip, 0);
        assert_eq!(exchange.system_ahead, i64::MIN);
        let none = best(&VecDeque::new(), MachineClock::System, 0);
        assert_eq!(none.uncertainty_ns, u64::MAX);
    }
}
