//! How far the clocks of another machine are ahead of those of this one, estimated as NTP does
//! (RFC 5905): the other machine reads its clocks between a request and its reply, so half of the
//! round trip bounds the error.

use crate::error::Error;
use crate::network::{connect, failed};
use rc_management::component::Request;
use rc_management::observation::Clocks;
use rc_management::{CallError, Client};
use rc_middleware::now;
use std::collections::VecDeque;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

/// How long a component may take to reply.
const LIMIT: Duration = Duration::from_secs(3);
/// The round trips at the start, one directly after the other.
const AT_FIRST: usize = 8;
/// Time between two later round trips: clocks drift.
const PERIOD: Duration = Duration::from_secs(1);
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

/// Estimate of a clock of another machine.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Estimate {
    /// The first reply has not come.
    Pending,
    /// The offset.
    Known(Offset),
    /// The component cannot be asked at present; it is asked again each second.
    Failed(String),
    /// The component does not report its clocks: it was built by an older version.
    Refused(String),
}

/// Estimates the clocks of the machine of a component, over its management socket. A thread makes
/// the round trips, so the caller never waits for them.
pub struct RemoteClock {
    component: String,
    state: Arc<Mutex<State>>,
    /// The thread ends when this is dropped.
    _stop: Sender<()>,
}

/// Results of the thread.
#[derive(Default)]
struct State {
    exchanges: VecDeque<Exchange>,
    failure: Option<Failure>,
}

/// Error of an exchange.
enum Failure {
    Failed(String),
    Refused(String),
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
    /// Begins to ask a component. The error says why the system starts no thread.
    pub fn start(network: &str, component: &str) -> Result<Self, Error> {
        let (stop, stopped) = channel();
        let state = Arc::new(Mutex::new(State::default()));
        let clock = Self {
            component: component.to_owned(),
            state: Arc::clone(&state),
            _stop: stop,
        };
        let (network, component) = (network.to_owned(), component.to_owned());
        std::thread::Builder::new()
            .name("clock".into())
            .spawn(move || {
                loop {
                    let failure = ask(&network, &component, &state, &stopped);
                    let Some(failure) = failure else { return };
                    let is_final = matches!(failure, Failure::Refused(_));
                    // A component that starts again may be on another machine.
                    *locked(&state) = State {
                        exchanges: VecDeque::new(),
                        failure: Some(failure),
                    };
                    if is_final || is_stopped(&stopped, PERIOD) {
                        return;
                    }
                }
            })
            .map_err(|error| Error::system("a thread for the remote clock", &error))?;
        Ok(clock)
    }

    /// The component whose machine it is.
    pub fn component(&self) -> &str {
        &self.component
    }

    /// The present estimate.
    pub fn estimate(&self, clock: MachineClock) -> Estimate {
        let state = locked(&self.state);
        match (best(&state.exchanges, clock, now()), &state.failure) {
            (Some(offset), _) => Estimate::Known(offset),
            (None, None) => Estimate::Pending,
            (None, Some(Failure::Failed(why))) => Estimate::Failed(why.clone()),
            (None, Some(Failure::Refused(why))) => Estimate::Refused(why.clone()),
        }
    }
}

fn locked(state: &Mutex<State>) -> std::sync::MutexGuard<'_, State> {
    state.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Waits, and returns whether the clock is no longer needed.
fn is_stopped(stopped: &Receiver<()>, wait: Duration) -> bool {
    stopped.recv_timeout(wait) != Err(RecvTimeoutError::Timeout)
}

/// Makes round trips until one fails; none if the clock is no longer needed.
fn ask(
    network: &str,
    component: &str,
    state: &Mutex<State>,
    stopped: &Receiver<()>,
) -> Option<Failure> {
    let mut client = match connect(network, component, LIMIT) {
        Ok(client) => client,
        Err(error) => return Some(Failure::Failed(error.to_string())),
    };
    for number in 1.. {
        match exchange(&mut client) {
            Ok(exchange) => keep(&mut locked(state).exchanges, exchange),
            Err(error) => {
                let is_refused = matches!(error, CallError::Refused(_));
                let reason = failed(component, &error).to_string();
                return Some(if is_refused {
                    Failure::Refused(reason)
                } else {
                    Failure::Failed(reason)
                });
            }
        }
        let wait = if number < AT_FIRST {
            Duration::ZERO
        } else {
            PERIOD
        };
        if is_stopped(stopped, wait) {
            break;
        }
    }
    None
}

/// Makes a round trip.
fn exchange(client: &mut Client) -> Result<Exchange, CallError> {
    let begin = now();
    let asked = client.call(&Request::Clocks, LIMIT);
    // In this order, a pause between the two counts as part of the round trip.
    let system = system_time();
    let at = now();
    let theirs: Clocks = asked?;
    Ok(Exchange::new(begin, (at, system), theirs))
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

/// The offset with the smallest uncertainty; none without an exchange.
fn best(exchanges: &VecDeque<Exchange>, clock: MachineClock, now: u64) -> Option<Offset> {
    let offsets = exchanges.iter().map(|exchange| exchange.offset(clock, now));
    offsets.min_by_key(|offset| offset.uncertainty_ns)
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
            let offset = best(&exchanges, clock, begin + 53 * MS).expect("an offset");
            assert_eq!(offset.uncertainty_ns, 3 * MS / 2);
            assert_eq!(offset.ahead_ns - ahead, MS as i64 / 2);
            // Two seconds later, the clocks may have drifted apart.
            let later = best(&exchanges, clock, begin + 53 * MS + 2 * SECOND).expect("an offset");
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
        let offset = offset.expect("an offset");
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
        assert_eq!(best(&VecDeque::new(), MachineClock::System, 0), None);
    }
}
