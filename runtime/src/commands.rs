//! Commands of the management thread to the worker thread.

use crate::fired_event::FiredEvent;
use crate::proposal::Proposal;
use crate::tool_message::ToolMessage;
use rc_middleware::WakeEvent;
use std::collections::VecDeque;
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
    /// Handle a message of a tool.
    Message(Arc<ToolMessage>),
    /// Give an event to the state machine.
    Fire(Arc<FiredEvent>),
}

/// The most messages of tools that wait.
const MOST_MESSAGES: usize = 64;

/// The commands that wait for the worker thread: at most one of each kind, the newest, 64 messages
/// of tools, and the events whose clients still wait, at most 64. A worker that hangs collects no
/// others.
#[derive(Debug)]
pub(crate) struct CommandQueue {
    waiting: Mutex<Waiting>,
    wake_event: WakeEvent,
}

#[derive(Debug, Default)]
struct Waiting {
    period: Option<Duration>,
    emergency: Option<bool>,
    /// An earlier change has been withdrawn when the next one comes.
    parameters: Option<Arc<Proposal>>,
    messages: VecDeque<Arc<ToolMessage>>,
    fired: Vec<Arc<FiredEvent>>,
}

impl CommandQueue {
    pub(crate) fn new(wake_event: WakeEvent) -> Self {
        Self {
            waiting: Mutex::default(),
            wake_event,
        }
    }

    /// Adds a command and wakes the worker thread; false if too many messages wait.
    pub(crate) fn push(&self, command: Command) -> bool {
        let mut waiting = self.waiting();
        match command {
            Command::Period(period) => waiting.period = Some(period),
            Command::Emergency(active) => waiting.emergency = Some(active),
            Command::Parameters(proposal) => waiting.parameters = Some(proposal),
            Command::Message(_) if waiting.messages.len() >= MOST_MESSAGES => return false,
            Command::Message(message) => waiting.messages.push_back(message),
            Command::Fire(fired) => {
                waiting.fired.retain(|fired| fired.is_queued());
                waiting.fired.push(fired);
            }
        }
        drop(waiting);
        self.wake_event.wake();
        true
    }

    /// Takes the commands of one turn, an emergency first: all that control the component, and one
    /// message of a tool. If others wait, the next turn begins at once.
    pub(crate) fn take(&self) -> impl Iterator<Item = Command> + use<> {
        let mut waiting = self.waiting();
        let message = waiting.messages.pop_front();
        let messages = std::mem::take(&mut waiting.messages);
        let Waiting {
            period,
            emergency,
            parameters,
            messages: _,
            fired,
        } = std::mem::replace(
            &mut *waiting,
            Waiting {
                messages,
                ..Waiting::default()
            },
        );
        if !waiting.messages.is_empty() {
            self.wake_event.wake();
        }
        drop(waiting);
        let emergency = emergency.map(Command::Emergency);
        let period = period.map(Command::Period);
        let parameters = parameters.map(Command::Parameters);
        let message = message.map(Command::Message);
        let fired = fired.into_iter().map(Command::Fire);
        let others = emergency.into_iter().chain(period).chain(parameters);
        others.chain(fired).chain(message)
    }

    fn waiting(&self) -> MutexGuard<'_, Waiting> {
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
