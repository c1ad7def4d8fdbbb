//! A state machine with every name resolved.

use rc_diagnostics::Span;
use rc_syntax::Name;

/// One state machine.
#[derive(Clone, Debug, PartialEq)]
pub struct StateMachine {
    /// Its name.
    pub name: Name,
    /// The states that are in no other state. It is never parallel.
    pub top: Region,
    /// All states, also those in other states; [`Machine::state`] gives one of them.
    pub states: Vec<State>,
    /// All transitions. Those of one state are in the order of the file, which is their priority.
    pub transitions: Vec<Transition>,
}

impl StateMachine {
    /// One state.
    pub fn state(&self, id: StateId) -> &State {
        &self.states[id.0]
    }

    /// Every state, in the order of [`Machine::states`].
    pub fn ids(&self) -> impl Iterator<Item = StateId> + use<> {
        (0..self.states.len()).map(StateId)
    }
}

/// A state of a [`Machine`]: its index in [`Machine::states`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct StateId(pub(crate) usize);

/// One state.
#[derive(Clone, Debug, PartialEq)]
pub struct State {
    /// Its name, unique in the machine; upper and lower case count as equal.
    pub name: Name,
    /// Its documentation.
    pub doc: Vec<String>,
    /// What it is.
    pub kind: StateKind,
    /// The state that it is in.
    pub parent: Option<StateId>,
    /// The states that are in it.
    pub region: Option<Region>,
    /// What is done on entering it; only SCXML says.
    pub on_entry: Vec<Action>,
    /// What is done on leaving it; only SCXML says.
    pub on_exit: Vec<Action>,
}

/// What a state is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StateKind {
    /// An ordinary state, with or without substates.
    Plain,
    /// Entering it ends the machine or the state that it is in.
    End,
    /// Entering it resumes what was left in its parent, all of it or only the direct substates. The first time,
    /// its only transition is taken. Only SCXML has it.
    History {
        /// Whether substates of substates are resumed, too.
        deep: bool,
    },
}

/// The states that are directly in the machine or in one state.
#[derive(Clone, Debug, PartialEq)]
pub struct Region {
    /// The documentation of the block; of the machine, where it is its top.
    pub doc: Vec<String>,
    /// Whether all of its states are active together. Otherwise it is one of them.
    pub parallel: bool,
    /// What is entered with it; nothing where it is parallel. SMDSL names one of its states; SCXML may name
    /// states deeper inside, and several in different parts of a parallel state.
    pub initial: Vec<StateId>,
    /// What is done before `initial` is entered; only SCXML says.
    pub actions: Vec<Action>,
    /// Its states: the initial one, the others in the order of the file, the end state. In SCXML, the file's order.
    pub states: Vec<StateId>,
    /// Where it is named.
    pub span: Span,
}

/// One way from a state.
#[derive(Clone, Debug, PartialEq)]
pub struct Transition {
    /// Where it begins.
    pub source: StateId,
    /// Where it leads. SMDSL has one state (`a => b, c;` are two transitions); SCXML may have none, where only
    /// actions are done, or several in different parts of a parallel state.
    pub targets: Vec<StateId>,
    /// The events that start it, as written; only SCXML says.
    pub events: Vec<Name>,
    /// What must hold, as written; only SCXML says.
    pub cond: Option<Name>,
    /// What is done on the way; only SCXML says.
    pub actions: Vec<Action>,
    /// Its documentation.
    pub doc: Vec<String>,
    /// Where it stands.
    pub span: Span,
}

/// Something that is done.
#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    /// `<raise event="…"/>`
    Raise(Name),
    /// `<log label="…" expr="…"/>`
    Log {
        /// What is written before the value.
        label: Option<Name>,
        /// The value, as written.
        expr: Option<Name>,
    },
}
