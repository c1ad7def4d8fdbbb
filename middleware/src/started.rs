//! Calls that were started and have not ended, for the clients of all middlewares.

use crate::error::CallError;
pub use crate::qos::STARTED_CALLS;
use std::collections::BTreeMap;
use std::os::fd::BorrowedFd;
use std::time::{Duration, Instant};

/// The descriptor and time to wait for while started calls of a client have not ended.
#[derive(Clone, Copy, Debug)]
pub struct Awaiting<'c> {
    /// Readable when a call may have ended.
    pub descriptor: BorrowedFd<'c>,
    /// When the next call ends without a reply.
    pub until: Instant,
}

/// The state of a started call, as a client found it.
#[derive(Debug, PartialEq)]
pub enum StartedState {
    /// Its reply may still come.
    Pending,
    /// It has ended.
    Ended(Result<(), CallError>),
    /// No reply will come, except within this time after the first such look.
    Lost(CallError, Duration),
}

/// Started calls of one client, by the sequence numbers of their headers. `T` is the middleware's
/// state of a call. A call leaves once: when it ends, or when it is forgotten.
///
/// ```
/// use rc_middleware::started::{StartedState, StartedCalls};
/// use std::time::{Duration, Instant};
///
/// let mut calls = StartedCalls::default();
/// calls.add(7, "token", (Instant::now(), Duration::from_mins(1)));
/// assert_eq!(calls.next("lidar", false, |_, _| StartedState::Pending), None);
/// let ended = calls.next("lidar", false, |_, _| StartedState::Ended(Ok(())));
/// assert_eq!(ended, Some((7, "token", Ok(()))));
/// assert!(calls.is_empty());
/// ```
#[derive(Debug)]
pub struct StartedCalls<T> {
    calls: BTreeMap<u64, StartedCall<T>>,
    keeps_order: bool,
}

#[derive(Debug)]
struct StartedCall<T> {
    token: T,
    /// `None` for a limit beyond the clock.
    deadline: Option<Instant>,
    limit: Duration,
    /// When it was first found to be lost, and how long its reply may take from then on.
    lost: Option<(Instant, Duration)>,
}

impl<T> Default for StartedCalls<T> {
    fn default() -> Self {
        Self {
            calls: BTreeMap::new(),
            keeps_order: false,
        }
    }
}

impl<T> StartedCalls<T> {
    /// Whether no call is there.
    pub fn is_empty(&self) -> bool {
        self.calls.is_empty()
    }

    /// Whether a call ends only after those that were started before it, also if its reply or its
    /// deadline comes earlier.
    pub fn end_in_order(&mut self, keeps: bool) {
        self.keeps_order = keeps;
    }

    /// Fails if there is no room for one more call.
    pub fn check_room(&self) -> Result<(), CallError> {
        if self.calls.len() < STARTED_CALLS {
            Ok(())
        } else {
            Err(CallError::TooManyStarted)
        }
    }

    /// Adds a call that began at an instant and has a limit.
    pub fn add(&mut self, sequence: u64, token: T, (start, limit): (Instant, Duration)) {
        let call = StartedCall {
            token,
            deadline: start.checked_add(limit),
            limit,
            lost: None,
        };
        self.calls.insert(sequence, call);
    }

    /// Removes a call without an end.
    pub fn forget(&mut self, sequence: u64) -> Option<T> {
        self.calls.remove(&sequence).map(|call| call.token)
    }

    /// Removes the oldest call that has ended, and returns its result. `look` returns the state of
    /// a call; a reply counts also at its deadline and while the component stops.
    pub fn next(
        &mut self,
        address: &str,
        is_stopping: bool,
        mut look: impl FnMut(u64, &mut T) -> StartedState,
    ) -> Option<(u64, T, Result<(), CallError>)> {
        let mut ended = None;
        for (sequence, call) in &mut self.calls {
            let looked = look(*sequence, &mut call.token);
            if let Some(result) = call.result(looked, address, is_stopping) {
                ended = Some((*sequence, result));
            }
            if ended.is_some() || self.keeps_order {
                break;
            }
        }
        let (sequence, result) = ended?;
        let call = self.calls.remove(&sequence)?;
        Some((sequence, call.token, result))
    }

    /// When the next call ends without a reply.
    pub fn due(&self) -> Option<Instant> {
        let most = if self.keeps_order { 1 } else { usize::MAX };
        let ends = self.calls.values().take(most).flat_map(|call| {
            let lost = call.lost.map(|(since, grace)| since + grace);
            [lost, call.deadline].into_iter().flatten()
        });
        ends.min()
    }
}

impl<T> StartedCall<T> {
    fn result(
        &mut self,
        look: StartedState,
        address: &str,
        is_stopping: bool,
    ) -> Option<Result<(), CallError>> {
        let now = Instant::now();
        match look {
            StartedState::Ended(result) => return Some(result),
            StartedState::Lost(error, grace) => {
                let (since, grace) = *self.lost.get_or_insert((now, grace));
                if now.saturating_duration_since(since) >= grace {
                    return Some(Err(error));
                }
            }
            // The server is back.
            StartedState::Pending => self.lost = None,
        }
        if is_stopping {
            return Some(Err(CallError::Stopping));
        }
        let (address, limit) = (address.to_owned(), self.limit);
        let is_late = self.deadline.is_some_and(|deadline| now >= deadline);
        is_late.then_some(Err(CallError::Deadline { address, limit }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LONG: Duration = Duration::from_hours(1);

    fn calls(limits: &[Duration]) -> StartedCalls<u64> {
        let mut calls = StartedCalls::default();
        for (sequence, limit) in (1..).zip(limits) {
            calls.add(sequence, sequence, (Instant::now(), *limit));
        }
        calls
    }

    fn died() -> CallError {
        CallError::ServerDied("lidar".to_owned())
    }

    #[test]
    fn calls_end_once_in_their_order() {
        let mut calls = calls(&[LONG, LONG, LONG]);
        let second = calls.next("lidar", false, |_, call| match call {
            2 => StartedState::Ended(Ok(())),
            _ => StartedState::Pending,
        });
        assert_eq!(second, Some((2, 2, Ok(()))));
        let mut ended = Vec::new();
        while let Some((sequence, ..)) =
            calls.next("lidar", false, |_, _| StartedState::Ended(Err(died())))
        {
            ended.push(sequence);
        }
        assert_eq!(ended, [1, 3]);
        assert_eq!((calls.is_empty(), calls.due()), (true, None));
    }

    #[test]
    fn calls_may_have_to_end_in_the_order_of_their_start() {
        let mut calls = calls(&[LONG, Duration::ZERO, LONG]);
        calls.end_in_order(true);
        let only = |ended: u64| {
            move |sequence: u64, _: &mut u64| match sequence {
                sequence if sequence <= ended => StartedState::Ended(Ok(())),
                _ => StartedState::Pending,
            }
        };
        let later = |sequence: u64, _: &mut u64| match sequence {
            1 => StartedState::Pending,
            _ => StartedState::Ended(Ok(())),
        };
        assert_eq!(calls.next("lidar", false, later), None, "the first waits");
        // Its own deadline ends it, too, not that of the second.
        let due = calls.due().expect("an end");
        assert!(due > Instant::now() + LONG / 2);
        assert_eq!(calls.next("lidar", false, only(3)), Some((1, 1, Ok(()))));
        let (sequence, _, late) = calls.next("lidar", false, only(1)).expect("its deadline");
        assert_eq!(sequence, 2);
        assert!(matches!(late, Err(CallError::Deadline { .. })));
        calls.end_in_order(false);
        assert_eq!(calls.next("lidar", false, only(3)), Some((3, 3, Ok(()))));
    }

    #[test]
    fn a_reply_counts_more_than_a_deadline_or_a_stop() {
        for (limit, is_stopping) in [(Duration::ZERO, false), (LONG, true)] {
            let mut calls = calls(&[limit]);
            let ended = calls.next("lidar", is_stopping, |_, _| StartedState::Ended(Ok(())));
            assert_eq!(ended, Some((1, 1, Ok(()))));
        }
        let late = calls(&[Duration::ZERO]).next("lidar", false, |_, _| StartedState::Pending);
        let limit = Duration::ZERO;
        let address = "lidar".to_owned();
        assert_eq!(
            late,
            Some((1, 1, Err(CallError::Deadline { address, limit })))
        );
        let stopped = calls(&[LONG]).next("lidar", true, |_, _| StartedState::Pending);
        assert_eq!(stopped, Some((1, 1, Err(CallError::Stopping))));
    }

    #[test]
    fn a_lost_call_ends_after_its_grace() {
        let mut lost = calls(&[LONG]);
        let ended = lost.next("lidar", false, |_, _| StartedState::Lost(died(), LONG / 2));
        assert_eq!(ended, None);
        let due = lost.due().expect("an end");
        assert!(
            due > Instant::now() + LONG / 4 && due < Instant::now() + LONG * 3 / 4,
            "the grace, not the deadline"
        );
        // A server that is back has its time until the deadline.
        assert_eq!(
            lost.next("lidar", false, |_, _| StartedState::Pending),
            None
        );
        let due = lost.due().expect("an end");
        assert!(due > Instant::now() + LONG * 3 / 4, "the deadline again");
        let ended = calls(&[LONG]).next("lidar", false, |_, _| {
            StartedState::Lost(died(), Duration::ZERO)
        });
        assert_eq!(ended, Some((1, 1, Err(died()))));
    }

    #[test]
    fn the_number_of_calls_is_limited() {
        let mut full = calls(&[LONG; STARTED_CALLS]);
        let error = CallError::TooManyStarted;
        assert_eq!(full.check_room(), Err(error));
        assert_eq!((full.forget(3), full.forget(3)), (Some(3), None));
        assert_eq!(full.check_room(), Ok(()));
    }

    #[test]
    fn a_limit_beyond_the_clock_never_ends() {
        let mut endless = calls(&[Duration::MAX]);
        assert_eq!(
            (
                endless.next("lidar", false, |_, _| StartedState::Pending),
                endless.due()
            ),
            (None, None)
        );
    }
}
