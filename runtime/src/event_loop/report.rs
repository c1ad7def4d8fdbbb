//! Results of messages: counts for the status, and lines of the log.

use super::{COUNT_INTERVAL, HANDLERS_A_TURN, LOG_PAUSE};
use crate::status::{Activity, Shared};
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

/// The messages of a turn that the status does not count yet.
pub(super) struct HandledMessages {
    all: Vec<Handled>,
    /// When the handler of the first one of them began.
    since: Instant,
}

impl HandledMessages {
    /// No message, with room for those of a turn.
    pub(super) fn new(now: Instant) -> Self {
        Self {
            all: Vec::with_capacity(HANDLERS_A_TURN),
            since: now,
        }
    }

    /// Adds a message whose handler began at `start`.
    pub(super) fn push(&mut self, message: Handled, start: Instant) {
        if self.all.is_empty() {
            self.since = start;
        }
        self.all.push(message);
    }

    /// Whether the oldest message has waited for `COUNT_INTERVAL`.
    pub(super) fn is_due(&self, now: Instant) -> bool {
        !self.all.is_empty() && now.saturating_duration_since(self.since) >= COUNT_INTERVAL
    }

    /// Adds the messages to the status: one lock for many messages, not one a message. A handler may
    /// take no longer than `limit`.
    pub(super) fn count(&mut self, shared: &Shared, limit: Option<Duration>) {
        if self.all.is_empty() {
            return;
        }
        let mut status = shared.status();
        for message in self.all.drain(..) {
            let counters = &mut status.slots[message.slot];
            match message.end {
                End::Refused => counters.refused += 1,
                End::Handled | End::Failed => {
                    let is_handled = message.end == End::Handled;
                    counters.handled(message.took, message.lost, is_handled);
                }
            }
            if limit.is_some_and(|limit| message.took > limit) {
                let handler = Activity::Handler(message.slot);
                status.delta.overrun(handler, message.took);
            }
        }
    }
}

/// Log messages about one thing, at most one in [`LOG_PAUSE`].
#[derive(Debug, Default)]
pub(crate) struct LogLimit(Option<Instant>);

impl LogLimit {
    /// Returns whether a message may be logged now, and notes that it is.
    pub(crate) fn allows(&mut self, now: Instant) -> bool {
        let pause = |last: Instant| now.saturating_duration_since(last);
        let allows = self.0.is_none_or(|last| pause(last) >= LOG_PAUSE);
        if allows {
            self.0 = Some(now);
        }
        allows
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_message_a_pause_is_logged() {
        let now = Instant::now();
        let mut limit = LogLimit::default();
        let times = [0, 1, 999, 1000, 1001, 2000].map(Duration::from_millis);
        let allowed = times.map(|after| limit.allows(now + after));
        assert_eq!(allowed, [true, false, false, true, false, true]);
    }

    #[test]
    fn messages_are_counted_when_the_first_one_has_waited() {
        let now = Instant::now();
        let mut messages = HandledMessages::new(now);
        assert!(!messages.is_due(now + COUNT_INTERVAL));
        let handled = || Handled {
            slot: 0,
            took: Duration::ZERO,
            lost: 0,
            end: End::Handled,
        };
        let start = now + Duration::from_secs(1);
        messages.push(handled(), start);
        messages.push(handled(), start + COUNT_INTERVAL);
        assert!(!messages.is_due(start + COUNT_INTERVAL / 2));
        assert!(messages.is_due(start + COUNT_INTERVAL));
    }
}
