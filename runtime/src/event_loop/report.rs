//! Results of messages: counts for the status, and lines of the log.

use super::{COUNT_INTERVAL, EventLoop, LOG_PAUSE};
use crate::status::Activity;
use rc_middleware::typed::HandlerError;
use std::time::{Duration, Instant};

/// One handled message.
pub(super) struct Handled {
    pub(super) slot: usize,
    pub(super) took: Duration,
    /// Samples of the same sender that were lost right before it.
    pub(super) lost: u64,
    pub(super) end: End,
}

/// Result of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum End {
    Handled,
    /// It was invalid, or its handler failed.
    Failed,
    /// The state of the component refused it, so no handler ran.
    Refused,
}

/// Why a message was not handled.
#[derive(Debug)]
pub(crate) enum NotHandled {
    Failed(HandlerError),
    /// The state of the component refuses it.
    Refused(String),
}

impl From<HandlerError> for NotHandled {
    fn from(error: HandlerError) -> Self {
        Self::Failed(error)
    }
}

impl std::fmt::Display for NotHandled {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Failed(error) => error.fmt(f),
            Self::Refused(reason) => f.write_str(reason),
        }
    }
}

impl NotHandled {
    pub(super) fn end(&self) -> End {
        match self {
            Self::Failed(_) => End::Failed,
            Self::Refused(_) => End::Refused,
        }
    }
}

impl EventLoop<'_> {
    /// Notes a message that was handled from `start` until `now`. The status counts an overrun, a
    /// loss and an error at once, for the turn may go on for long, or never end.
    pub(super) fn handled(
        &mut self,
        at: usize,
        start: Instant,
        now: Instant,
        lost: u64,
        result: Result<(), NotHandled>,
    ) {
        let took = now.saturating_duration_since(start);
        if self.handled.is_empty() {
            self.handled_since = start;
        }
        self.handled.push(Handled {
            slot: self.ports[at].slot,
            took,
            lost,
            end: result
                .as_ref()
                .map_or_else(NotHandled::end, |()| End::Handled),
        });
        let waited = now.saturating_duration_since(self.handled_since);
        let is_overrun = self.is_overrun(took);
        if is_overrun || lost > 0 || result.is_err() || waited >= COUNT_INTERVAL {
            self.count_handled();
        }
        if is_overrun {
            let message = format!(
                "a handler took {took:?}, longer than the period of {:?}",
                self.period
            );
            self.log_failure(at, &message);
        }
        match result {
            Ok(()) => {}
            Err(NotHandled::Failed(error)) => {
                self.log_failure(at, &format!("a message was not handled: {error}"));
            }
            Err(NotHandled::Refused(reason)) => self.log_refusal(at, &reason),
        }
    }

    /// Adds the handled messages to the status: one lock for many messages, not one a message.
    pub(super) fn count_handled(&mut self) {
        if self.handled.is_empty() {
            return;
        }
        let keeps_period = self.role.keeps_period();
        let mut status = self.shared.status();
        for Handled {
            slot,
            took,
            lost,
            end,
        } in self.handled.drain(..)
        {
            let counters = &mut status.slots[slot];
            match end {
                End::Refused => counters.refused += 1,
                End::Handled | End::Failed => {
                    counters.handled(took, lost, end == End::Handled);
                }
            }
            if keeps_period && took > self.period {
                status.delta.overrun(Activity::Handler(slot), took);
            }
        }
    }

    /// Logs a failure at a port, at most once a second.
    fn log_failure(&mut self, at: usize, message: &str) {
        self.shared.status().last_error = Some(message.to_owned());
        self.warn(at, message);
    }

    /// Logs that the state of the component refuses a request, at most once a second. This is no
    /// error of the component.
    fn log_refusal(&mut self, at: usize, reason: &str) {
        let count = self.shared.status().slots[self.ports[at].slot].refused;
        self.warn(
            at,
            &format!("a request is refused, number {count}: {reason}"),
        );
    }

    fn warn(&mut self, at: usize, message: &str) {
        let port = &mut self.ports[at];
        if port.logged.is_none_or(|last| last.elapsed() >= LOG_PAUSE) {
            port.logged = Some(Instant::now());
            tracing::warn!("slot {}: {message}", port.of.name);
        }
    }
}
