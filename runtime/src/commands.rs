//! Commands of the management thread to the worker thread.

use crate::fired_event::FiredEvent;
use crate::proposal::Proposal;
use crate::tool_message::ToolMessage;
use crate::waker::Waker;
use rc_middleware::WakeEvent;
use std::collections::VecDeque;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::Duration;

/// A command to the worker thread, which executes it between two runs of `compute()` or handlers.
#[derive(Debug)]
pub(crate) enum Command {
    /// Set the period of `compute()`.
    Period(Duration),
    /// Enter or leave the state Emergency.
    Emergency(bool),
    /// Offer a change of parameters to the worker.
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
    /// How many commands about the emergency the worker has executed.
    executed: AtomicU64,
    management: OnceLock<Waker>,
    wake_event: WakeEvent,
}

#[derive(Debug, Default)]
struct Waiting {
    period: Option<Duration>,
    emergency: Option<Emergency>,
    /// How many commands about the emergency have arrived.
    emergencies: u64,
    /// An earlier change has been withdrawn when the next one comes.
    parameters: Option<Arc<Proposal>>,
    messages: VecDeque<Arc<ToolMessage>>,
    fired: Vec<Arc<FiredEvent>>,
}

/// The effect of the waiting commands on the state Emergency. A command that enters it is never
/// lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Emergency {
    Enter,
    Leave,
    EnterAndLeave,
}

impl Emergency {
    /// The commands that wait, and then one more.
    fn and(before: Option<Self>, active: bool) -> Self {
        match (before, active) {
            (_, true) => Self::Enter,
            (None | Some(Self::Leave), false) => Self::Leave,
            (Some(Self::Enter | Self::EnterAndLeave), false) => Self::EnterAndLeave,
        }
    }

    fn commands(self) -> &'static [bool] {
        match self {
            Self::Enter => &[true],
            Self::Leave => &[false],
            Self::EnterAndLeave => &[true, false],
        }
    }
}

impl CommandQueue {
    pub(crate) fn new(wake_event: WakeEvent) -> Self {
        Self {
            waiting: Mutex::default(),
            executed: AtomicU64::new(0),
            management: OnceLock::new(),
            wake_event,
        }
    }

    /// Sets the thread that is woken when the worker has executed commands about the emergency.
    pub(crate) fn report_to(&self, management: Waker) {
        // A component has one management.
        let _ = self.management.set(management);
    }

    /// How many commands about the emergency have arrived, and how many the worker has executed.
    pub(crate) fn emergencies(&self) -> (u64, u64) {
        (
            self.waiting().emergencies,
            self.executed.load(Ordering::Acquire),
        )
    }

    /// Notes that the worker has executed so many commands about the emergency.
    pub(crate) fn executed(&self, emergencies: u64) {
        if self.executed.swap(emergencies, Ordering::Release) != emergencies
            && let Some(management) = self.management.get()
        {
            management.wake();
        }
    }

    /// Adds a command and wakes the worker thread; false if too many messages wait.
    pub(crate) fn push(&self, command: Command) -> bool {
        let mut waiting = self.waiting();
        match command {
            Command::Period(period) => waiting.period = Some(period),
            Command::Emergency(active) => {
                waiting.emergency = Some(Emergency::and(waiting.emergency, active));
                waiting.emergencies += 1;
            }
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
    /// [`Self::executed`] takes the number.
    pub(crate) fn take(&self) -> (u64, impl Iterator<Item = Command> + use<>) {
        let mut waiting = self.waiting();
        let message = waiting.messages.pop_front();
        let messages = std::mem::take(&mut waiting.messages);
        let before = waiting.emergencies;
        let Waiting {
            period,
            emergency,
            emergencies,
            parameters,
            messages: _,
            fired,
        } = std::mem::replace(
            &mut *waiting,
            Waiting {
                messages,
                emergencies: before,
                ..Waiting::default()
            },
        );
        if !waiting.messages.is_empty() {
            self.wake_event.wake();
        }
        drop(waiting);
        let emergency = emergency.map_or(&[] as &[bool], Emergency::commands).iter();
        let emergency = emergency.copied().map(Command::Emergency);
        let period = period.map(Command::Period);
        let parameters = parameters.map(Command::Parameters);
        let message = message.map(Command::Message);
        let fired = fired.into_iter().map(Command::Fire);
        let others = emergency.chain(period).chain(parameters);
        (emergencies, others.chain(fired).chain(message))
    }

    fn waiting(&self) -> MutexGuard<'_, Waiting> {
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_emergency_is_lost_between_two_turns() {
        let queue = CommandQueue::new(WakeEvent::new().expect("an event"));
        let mut count = 0;
        for (asked, executed) in [
            (&[true][..], &[true][..]),
            (&[false], &[false]),
            (&[true, false], &[true, false]),
            (&[false, true], &[true]),
            (&[true, false, true], &[true]),
            (&[false, true, false], &[true, false]),
            (&[true, false, true, false, false], &[true, false]),
        ] {
            for &active in asked {
                assert!(queue.push(Command::Emergency(active)));
                count += 1;
            }
            let (number, commands) = queue.take();
            let commands = commands.map(|command| match command {
                Command::Emergency(active) => active,
                other => panic!("{other:?}"),
            });
            assert_eq!(commands.collect::<Vec<_>>(), executed, "{asked:?}");
            assert_eq!(number, count);
            assert!(queue.emergencies().1 < count, "the worker executes them");
            queue.executed(number);
            assert_eq!(queue.emergencies(), (count, count));
        }
    }
}
