//! How a client waits for the reply to a call.

use rc_middleware::{CallError, WakeEvent, wait};
use std::os::fd::AsFd;
use std::time::{Duration, Instant};

/// Longest wait before the client looks for a stop: another thread may have cleared the wake event.
const CYCLE: Duration = Duration::from_millis(50);

/// State of a call, for a client that looks for the reply.
pub struct CallState {
    /// Whether the server is there. Determine it before the reply: a reply that a server sent
    /// before it left is there by then, or comes at once.
    pub has_server: bool,
    /// The result of the call, if the reply has come.
    pub reply: Option<Result<(), CallError>>,
}

/// Why a call has no reply.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unanswered {
    /// The server has gone.
    ServerDied,
    /// The component stops.
    Stopping,
    /// The time is over.
    Deadline,
}

impl Unanswered {
    /// The error of a call to the server at `address`, which had this time.
    pub fn error(self, address: &str, limit: Duration) -> CallError {
        let address = address.to_owned();
        match self {
            Self::ServerDied => CallError::ServerDied(address),
            Self::Stopping => CallError::Stopping,
            Self::Deadline => CallError::Deadline { address, limit },
        }
    }
}

/// A call whose request was sent.
pub struct PendingCall<'a> {
    /// Readable when a sample has come, or the server has changed.
    pub signal: &'a WakeEvent,
    /// Stops the component.
    pub wake_event: &'a WakeEvent,
    /// How long the client polls before it sleeps.
    pub spin: Duration,
    /// Longest wait for the reply of a server that has gone: samples and discovery arrive on
    /// different threads.
    pub last_words: Duration,
}

impl PendingCall<'_> {
    /// Waits for the reply, at most until `limit` has passed since `start`, and returns the result
    /// of the call.
    ///
    /// # Errors
    /// There is no reply.
    pub fn wait(
        &self,
        (start, limit): (Instant, Duration),
        mut state: impl FnMut() -> CallState,
    ) -> Result<Result<(), CallError>, Unanswered> {
        let mut interrupted = false;
        loop {
            self.signal.clear();
            let CallState { has_server, reply } = state();
            if let Some(result) = reply {
                return Ok(result);
            }
            if !has_server {
                wait(&[self.signal.as_fd()], self.last_words);
                return state().reply.ok_or(Unanswered::ServerDied);
            }
            if self.wake_event.is_stopping() {
                return Err(Unanswered::Stopping);
            }
            let elapsed = start.elapsed();
            if elapsed >= limit {
                return Err(Unanswered::Deadline);
            }
            if elapsed < self.spin {
                std::hint::spin_loop();
                continue;
            }
            // The wake event stays readable for its owner: this call does not wait for it twice.
            let descriptors = [self.signal.as_fd(), self.wake_event.as_fd()];
            let waited = if interrupted { 1 } else { 2 };
            let left = limit.saturating_sub(elapsed);
            interrupted |= wait(&descriptors[..waited], left.min(CYCLE)) & 2 != 0;
        }
    }
}
