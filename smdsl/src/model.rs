//! The model of SMDSL: a state machine with all names resolved.

use rc_diagnostics::Span;
use rc_syntax::Name;
use std::time::Duration;

/// One state machine.
#[derive(Clone, Debug, PartialEq)]
pub struct StateMachine {
    /// The name as declared.
    pub name: Name,
    /// The region of the states without a parent. It is never parallel.
    pub top: Region,
    /// All states, including substates, indexed by [`StateId`].
    pub states: Vec<State>,
    /// All transitions. Transitions of one state are in order of priority, the order of the file.
    pub transitions: Vec<Transition>,
    /// Where the file names states that it declares elsewhere.
    pub references: Vec<(Span, StateId)>,
}

impl StateMachine {
    /// Looks up a state.
    pub fn state(&self, id: StateId) -> &State {
        &self.states[id.0]
    }

    /// The states that transitions cannot enter from the initial state.
    pub fn unreachable(&self) -> impl Iterator<Item = &State> {
        let entered = self.entered();
        let states = self.states.iter().zip(entered);
        states
            .filter(|(_, entered)| !entered)
            .map(|(state, _)| state)
    }

    /// The states that transitions from the initial state can enter.
    ///
    /// Entering a state enters its ancestors and its initial substates. Entering one region of a
    /// parallel state counts as entering all of them: a missing warning is better than a wrong one.
    pub(crate) fn entered(&self) -> Vec<bool> {
        let mut targets_of: Vec<Vec<StateId>> = vec![Vec::new(); self.states.len()];
        for transition in &self.transitions {
            targets_of[transition.source.0].extend(&transition.targets);
        }
        let mut entered = vec![false; self.states.len()];
        let mut entered_directly = entered.clone();
        let mut pending: Vec<(StateId, bool)> =
            self.top.initial.iter().map(|id| (*id, true)).collect();
        while let Some((id, directly)) = pending.pop() {
            let state = self.state(id);
            let region = state.region.as_ref();
            if directly && !entered_directly[id.0] {
                entered_directly[id.0] = true;
                pending.extend(region.iter().flat_map(|r| &r.initial).map(|id| (*id, true)));
            }
            if !entered[id.0] {
                entered[id.0] = true;
                pending.extend(targets_of[id.0].iter().map(|id| (*id, true)));
                let parts = region.filter(|r| r.parallel).map(|r| &r.states);
                let parts = parts.into_iter().flatten();
                // A history state is not a region of its parallel state.
                let parts =
                    parts.filter(|id| !matches!(self.state(**id).kind, StateKind::History { .. }));
                pending.extend(parts.map(|id| (*id, true)));
                pending.extend(state.parent.map(|parent| (parent, false)));
            }
        }
        entered
    }

    /// All states, in the order of [`StateMachine::states`].
    pub fn ids(&self) -> impl Iterator<Item = StateId> + use<> {
        (0..self.states.len()).map(StateId)
    }
}

/// Identifies a state: its index in [`StateMachine::states`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct StateId(pub(crate) usize);

/// One state.
#[derive(Clone, Debug, PartialEq)]
pub struct State {
    /// Name, unique in the machine. Case is ignored.
    pub name: Name,
    /// The lines of its documentation.
    pub doc: Vec<String>,
    /// The kind of state.
    pub kind: StateKind,
    /// The state that contains it.
    pub parent: Option<StateId>,
    /// Substates; `None` for an atomic state.
    pub region: Option<Region>,
    /// The blocks of actions on entry. Only SCXML has them.
    pub on_entry: Vec<Vec<Action>>,
    /// The blocks of actions on exit. Only SCXML has them.
    pub on_exit: Vec<Vec<Action>>,
}

/// The kind of a state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StateKind {
    /// An ordinary state, with or without substates.
    Plain,
    /// An end state: entering it ends its parent or the machine.
    End,
    /// A history state: entering it resumes the last active substates of its parent. The first
    /// time, its only transition is taken. Only SCXML has history states.
    History {
        /// Whether all descendants are resumed, or only the direct substates.
        deep: bool,
    },
}

/// The states directly inside the machine or inside one state.
#[derive(Clone, Debug, PartialEq)]
pub struct Region {
    /// The lines of documentation of the block, or of the machine.
    pub doc: Vec<String>,
    /// Whether all of its states are active at the same time. Otherwise one of them is.
    pub parallel: bool,
    /// The initial states; none if parallel. SMDSL has one of the region's states. SCXML may name
    /// descendants, and several of them in different regions of a parallel state.
    pub initial: Vec<StateId>,
    /// The actions before `initial` is entered. Only SCXML has them.
    pub actions: Vec<Action>,
    /// States. SMDSL: the initial state, the others, the end state. SCXML: the order of the
    /// file.
    pub states: Vec<StateId>,
    /// The location of the block's name.
    pub span: Span,
}

/// A transition.
#[derive(Clone, Debug, PartialEq)]
pub struct Transition {
    /// The source state.
    pub source: StateId,
    /// The target states. SMDSL has one (`a => b, c;` are two transitions). SCXML may have none,
    /// for actions only, or several in different regions of a parallel state.
    pub targets: Vec<StateId>,
    /// The descriptors of the events that trigger it. In SMDSL the event of `a => b` is `AToB`.
    pub events: Vec<Name>,
    /// The guard condition. Only SCXML has it.
    pub cond: Option<Condition>,
    /// Whether the source is left only if a target is outside of it. Only SCXML has such
    /// transitions.
    pub internal: bool,
    /// The actions of the transition. Only SCXML has them.
    pub actions: Vec<Action>,
    /// The lines of its documentation.
    pub doc: Vec<String>,
    /// The location.
    pub span: Span,
}

/// The condition of a transition.
#[derive(Clone, Debug, PartialEq)]
pub enum Condition {
    /// `cond="name"`: a function of the worker.
    Guard(Name),
    /// `cond="In('state')"`
    In(StateId, Name),
}

impl Condition {
    /// The condition as written.
    pub fn text(&self) -> &str {
        let (Self::Guard(name) | Self::In(_, name)) = self;
        &name.text
    }
}

/// An action of a state or a transition.
#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    /// `<raise event="…"/>`, or `<send event="…" target="#_internal"/>`
    Raise(Name),
    /// `<send event="…" delay="…" id="…"/>`: an event for this machine itself.
    Send {
        /// The event.
        event: Name,
        /// The delay.
        delay: Duration,
        /// By which `cancel` finds it.
        id: Option<Name>,
    },
    /// `<cancel sendid="…"/>`
    Cancel(Name),
    /// `<script>name</script>`: calls a function of the worker.
    Call(Name),
    /// `<log label="…" expr="…"/>`
    Log {
        /// The text before the value.
        label: Option<Name>,
        /// The expression, as written.
        expr: Option<Name>,
    },
}
