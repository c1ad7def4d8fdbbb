//! A state machine as tables of numbers.
//!
//! States are in document order, each before its descendants. State 0 is the machine itself.

use std::borrow::Cow;

/// No state, no event, no transition.
pub const NONE: u16 = u16::MAX;

/// A part of a table, from `start` up to and without `end`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Range {
    /// The first index.
    pub start: u16,
    /// The index after the last one.
    pub end: u16,
}

impl Range {
    /// The indices.
    pub fn indices(self) -> std::ops::Range<usize> {
        usize::from(self.start)..usize::from(self.end)
    }

    /// Whether there is no index.
    pub fn is_empty(self) -> bool {
        self.start >= self.end
    }
}

/// A state machine.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Chart {
    /// The name of the machine.
    pub name: Cow<'static, str>,
    /// All states in document order, first the machine itself.
    pub states: Cow<'static, [State]>,
    /// The transitions, grouped by state, in order of priority. After them come those to the
    /// initial states, and those of history states.
    pub transitions: Cow<'static, [Transition]>,
    /// The names of the events. First those that the worker can fire.
    pub events: Cow<'static, [Cow<'static, str>]>,
    /// The number of events that the worker can fire.
    pub fireable: u16,
    /// Targets, events and history states, to which [`Range`]s point.
    pub lists: Cow<'static, [u16]>,
    /// Blocks of actions, each a part of `actions`.
    pub blocks: Cow<'static, [Range]>,
    /// The actions.
    pub actions: Cow<'static, [Action]>,
    /// The texts of `log`.
    pub texts: Cow<'static, [Cow<'static, str>]>,
    /// The names of the guards.
    pub guards: Cow<'static, [Cow<'static, str>]>,
    /// The names of the functions that actions call.
    pub functions: Cow<'static, [Cow<'static, str>]>,
    /// The event `error.execution`, [`NONE`] if no transition matches it.
    pub execution_error: u16,
    /// The event `error.communication`, [`NONE`] if no transition matches it.
    pub communication_error: u16,
    /// The number of history states.
    pub histories: u16,
}

/// A state.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct State {
    /// Name of the state.
    pub name: Cow<'static, str>,
    /// The names of its ancestors and its own, joined by dots.
    pub path: Cow<'static, str>,
    /// Kind of the state.
    pub kind: Kind,
    /// The state that contains it; [`NONE`] for the machine.
    pub parent: u16,
    /// The state after its last descendant.
    pub end: u16,
    /// The transition to its initial states, or that of a history state; else [`NONE`].
    pub initial: u16,
    /// Transitions from the state, in document order.
    pub transitions: Range,
    /// History states, in `lists`.
    pub histories: Range,
    /// The number of a history state.
    pub history: u16,
    /// The blocks of actions on entry.
    pub entry: Range,
    /// The blocks of actions on exit.
    pub exit: Range,
    /// The event `done.state.NAME`; [`NONE`] if no transition matches it.
    pub done: u16,
}

/// The kind of a state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Kind {
    /// A state without substates.
    Atomic,
    /// One of its substates is active.
    Compound,
    /// All of its substates are active.
    Parallel,
    /// An end state.
    Final,
    /// A history state that remembers the direct substates.
    Shallow,
    /// A history state that remembers the descendants without substates.
    Deep,
}

impl Kind {
    /// Whether the state is never active.
    pub fn is_history(self) -> bool {
        matches!(self, Self::Shallow | Self::Deep)
    }

    /// Whether the state has no substates.
    pub fn is_atomic(self) -> bool {
        matches!(self, Self::Atomic | Self::Final)
    }
}

/// A transition.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Transition {
    /// The state that it leaves.
    pub source: u16,
    /// The states that it enters, in `lists`. Without any, no state is left.
    pub targets: Range,
    /// The events that select it.
    pub trigger: Trigger,
    /// The guard.
    pub condition: Condition,
    /// The state whose descendants it leaves; [`NONE`] if it has no target, or if a history state
    /// decides.
    pub domain: u16,
    /// Whether a target is a history state.
    pub through_history: bool,
    /// Whether it leaves its source only if a target is outside of it.
    pub internal: bool,
    /// Actions of the transition.
    pub actions: Range,
}

/// The events that select a transition.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Trigger {
    /// The transition needs no event.
    Eventless,
    /// Any event.
    Any,
    /// One of these, sorted, in `lists`.
    Events(Range),
}

/// A guard.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Condition {
    /// There is none.
    Always,
    /// The state is active: `In('state')`.
    In(u16),
    /// A function of the worker.
    Guard(u16),
}

/// An action.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Action {
    /// Puts an event into the internal queue.
    Raise(u16),
    /// Puts an event into the external queue, after a delay.
    Send {
        /// The event.
        event: u16,
        /// The delay in nanoseconds.
        delay: u64,
        /// By which it can be cancelled; else [`NONE`].
        id: u16,
    },
    /// Withdraws the delayed events with this id.
    Cancel(u16),
    /// Logs a text.
    Log {
        /// The label, in `texts`; else [`NONE`].
        label: u16,
        /// The text, in `texts`; else [`NONE`].
        text: u16,
    },
    /// Calls a function of the worker.
    Call(u16),
}

impl Chart {
    /// A state.
    pub fn state(&self, state: u16) -> &State {
        &self.states[usize::from(state)]
    }

    /// A transition.
    pub fn transition(&self, transition: u16) -> &Transition {
        &self.transitions[usize::from(transition)]
    }

    /// A part of `lists`.
    pub fn list(&self, range: Range) -> &[u16] {
        &self.lists[range.indices()]
    }

    /// Whether `inner` is a descendant of `outer`.
    pub fn is_descendant(&self, inner: u16, outer: u16) -> bool {
        inner > outer && inner < self.state(outer).end
    }

    /// The states directly inside a state, without history states.
    pub fn children(&self, of: u16) -> impl Iterator<Item = u16> + '_ {
        let end = self.state(of).end;
        let mut next = of + 1;
        std::iter::from_fn(move || {
            while next < end {
                let child = next;
                next = self.state(child).end;
                if !self.state(child).kind.is_history() {
                    return Some(child);
                }
            }
            None
        })
    }

    /// The states that contain a state, from the inside out, without `until` and what contains it.
    pub fn ancestors(&self, of: u16, until: u16) -> impl Iterator<Item = u16> + '_ {
        let parent = move |state: u16| {
            let parent = self.state(state).parent;
            (parent != NONE && parent != until).then_some(parent)
        };
        std::iter::successors(parent(of), move |state| parent(*state))
    }
}
