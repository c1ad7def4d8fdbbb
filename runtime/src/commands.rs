//! Commands of the management thread to the worker thread.

use crate::proposal::Proposal;
use rc_middleware::WakeEvent;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// A command to the worker thread, which executes it between two runs of `compute()` or handlers.
#[derive(Debug)]
pub(crate) enum Command {
    /// Set the period of `compute()`.
    Period(Duration),
    /// Enter or leave the state Emergency.
    Emergency(bool),
    /// Put a change of parameters to the worker.
    Parameters(Arc<Proposal>),
}

/// The commands that wait for the worker thread.
#[derive(Debug)]
pub(crate) struct CommandQueue {
    commands: Mutex<Vec<Command>>,
    wake_event: WakeEvent,
}

impl CommandQueue {
    pub(crate) fn new(wake_event: WakeEvent) -> Self {
        Self {
            commands: Mutex::default(),
            wake_event,
        }
    }

    /// Adds a command and wakes the worker thread.
    pub(crate) fn push(&self, command: Command) {
        self.commands().push(command);
        self.wake_event.wake();
    }

    pub(crate) fn take(&self) -> Vec<Command> {
        std::mem::take(&mut *self.commands())
    }

    fn commands(&self) -> MutexGuard<'_, Vec<Command>> {
        self.commands.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
