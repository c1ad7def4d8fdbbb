//! An event that a tool fires, between the management thread and the worker's.

use crate::waker::Waker;
use rc_management::rpc::Error;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// An event that a tool fires.
#[derive(Debug)]
pub(crate) struct FiredEvent {
    /// Number in the chart.
    pub(crate) event: u16,
    progress: Mutex<Progress>,
    management: Waker,
}

#[derive(Debug)]
enum Progress {
    /// The machine has not seen it.
    Queued,
    /// A transition of the machine runs.
    InMachine,
    /// The time is up.
    Withdrawn,
    /// The active states afterwards, or why no transition was taken.
    Ended(Result<Vec<String>, String>),
}

impl FiredEvent {
    pub(crate) fn new(event: u16, management: Waker) -> Self {
        Self {
            event,
            progress: Mutex::new(Progress::Queued),
            management,
        }
    }

    fn progress(&self) -> MutexGuard<'_, Progress> {
        self.progress.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Whether the machine is still to take it.
    pub(crate) fn is_queued(&self) -> bool {
        matches!(*self.progress(), Progress::Queued)
    }

    pub(crate) fn has_ended(&self) -> bool {
        matches!(*self.progress(), Progress::Ended(_))
    }

    /// Whether the machine takes it now; not if its time is up.
    pub(crate) fn begin(&self) -> bool {
        let mut progress = self.progress();
        let begins = matches!(*progress, Progress::Queued);
        if begins {
            *progress = Progress::InMachine;
        }
        begins
    }

    /// Says what became of it.
    pub(crate) fn end(&self, result: Result<Vec<String>, String>) {
        *self.progress() = Progress::Ended(result);
        self.management.wake();
    }

    /// The result; without one, the event is withdrawn, and `reason` says why, from whether the
    /// machine has it.
    pub(crate) fn conclude(
        &self,
        reason: impl FnOnce(bool) -> String,
    ) -> Result<Vec<String>, Error> {
        let mut progress = self.progress();
        match &*progress {
            Progress::Ended(Ok(states)) => Ok(states.clone()),
            Progress::Ended(Err(reason)) => Err(Error::new(Error::WORKER_REFUSES, reason)),
            Progress::Queued | Progress::InMachine | Progress::Withdrawn => {
                let message = reason(matches!(*progress, Progress::InMachine));
                *progress = Progress::Withdrawn;
                Err(Error::new(Error::WORKER_TIMEOUT, message))
            }
        }
    }
}
