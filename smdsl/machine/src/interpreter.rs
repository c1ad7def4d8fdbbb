//! The algorithm of appendix D of SCXML 1.0. Functions have the names that it uses.

mod entry;

use crate::chart::{Action, Chart, Condition, Kind, NONE, Range, Trigger};
use crate::session::Session;
use crate::set::Set;
use std::collections::VecDeque;
use std::time::Duration;

/// The most microsteps of a macrostep.
pub const MAX_MICROSTEPS: usize = 1000;
/// The most delayed events that wait.
pub const MAX_DELAYED: usize = 256;
/// The most events that wait in the internal queue.
const MAX_INTERNAL: usize = 4096;

/// A function of the worker reported an error. The rest of its block of actions is skipped, and the
/// event `error.execution` follows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Failed;

/// Why a machine cannot go on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Error {
    /// A macrostep has more than [`MAX_MICROSTEPS`] microsteps: transitions without events, or
    /// events that the machine raises itself, form a loop.
    Endless,
    /// Too many raised events wait.
    TooManyRaised,
}

impl std::fmt::Display for Error {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Endless => write!(
                f,
                "the machine does not come to rest within {MAX_MICROSTEPS} transitions; \
                 look for a loop of transitions without events, or of raised events"
            ),
            Self::TooManyRaised => {
                write!(f, "more than {MAX_INTERNAL} raised events wait")
            }
        }
    }
}

impl std::error::Error for Error {}

/// The component around a machine.
pub trait Host {
    /// The session of this machine.
    fn session(&mut self) -> &mut Session;
    /// The time for delays, since any zero.
    fn now(&mut self) -> Duration;
    /// Evaluates a guard.
    fn guard(&mut self, guard: u16) -> bool;
    /// Calls a function as an action.
    ///
    /// # Errors
    /// The function failed.
    fn call(&mut self, function: u16) -> Result<(), Failed>;
    /// Runs after the actions on entry of a state.
    ///
    /// # Errors
    /// The function failed.
    fn enter(&mut self, state: u16) -> Result<(), Failed>;
    /// Runs after the actions on exit of a state, while it is still active.
    ///
    /// # Errors
    /// The function failed.
    fn exit(&mut self, state: u16) -> Result<(), Failed>;
    /// Logs a text.
    fn log(&mut self, label: &str, text: &str);
    /// The microstep of these transitions begins. `event` is [`NONE`] for transitions without one.
    fn begins(&mut self, event: u16, transitions: &[u16]) {
        let _ = (event, transitions);
    }
    /// The microstep has ended.
    fn ends(&mut self) {}
}

/// Result of an event.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Step {
    /// The event.
    pub event: u16,
    /// Whether a transition took it.
    pub taken: bool,
}

/// An event that waits for its time.
#[derive(Clone, Copy, Debug)]
struct Delayed {
    due: Duration,
    event: u16,
    id: u16,
}

/// Takes the steps of one machine.
#[derive(Debug)]
pub struct Interpreter {
    chart: &'static Chart,
    internal: VecDeque<u16>,
    /// Sorted by time; events of one time in the order in which they were sent.
    delayed: VecDeque<Delayed>,
    /// For each history state: what it remembers.
    history: Box<[Option<Set>]>,
    /// Memory of history states that were not visited yet.
    spare: Vec<Set>,
    enabled: Vec<u16>,
    /// The transitions that are taken, and the state whose descendants each of them leaves.
    filtered: Vec<(u16, u16)>,
    taken: Vec<u16>,
    exit: Set,
    entry: Set,
    default_entry: Set,
    /// For each state: the transition of a history state whose actions follow its entry.
    default_history: Box<[u16]>,
    /// Whether any transition needs no event.
    has_eventless: bool,
    running: bool,
    overflow: bool,
}

impl Interpreter {
    /// A machine that has not started.
    pub fn new(chart: &'static Chart) -> Self {
        let states = chart.states.len();
        let histories = usize::from(chart.histories);
        let mut transitions = chart.states.iter().flat_map(|s| s.transitions.indices());
        let has_eventless =
            transitions.any(|at| chart.transitions[at].trigger == Trigger::Eventless);
        Self {
            chart,
            has_eventless,
            internal: VecDeque::with_capacity(MAX_INTERNAL),
            delayed: VecDeque::with_capacity(MAX_DELAYED),
            history: vec![None; histories].into_boxed_slice(),
            spare: vec![Set::new(states); histories],
            enabled: Vec::with_capacity(states),
            filtered: Vec::with_capacity(states),
            taken: Vec::with_capacity(states),
            exit: Set::new(states),
            entry: Set::new(states),
            default_entry: Set::new(states),
            default_history: vec![NONE; states].into_boxed_slice(),
            running: false,
            overflow: false,
        }
    }

    /// Enters the initial states, and takes all transitions that need no further event.
    ///
    /// # Errors
    /// The machine does not come to rest.
    pub fn start<H: Host>(&mut self, host: &mut H) -> Result<(), Error> {
        self.running = true;
        let initial = self.chart.state(0).initial;
        self.filtered.clear();
        if initial != NONE {
            self.filtered.push((initial, 0));
            self.enter_states(host);
        }
        self.macrostep(host)
    }

    /// Handles the next event of the external queue, delayed ones included, and all steps that
    /// follow from it. `None` if the queue is empty, or if the machine has ended.
    ///
    /// # Errors
    /// The machine does not come to rest.
    pub fn step<H: Host>(&mut self, host: &mut H) -> Result<Option<Step>, Error> {
        if !self.running {
            return Ok(None);
        }
        self.release(host);
        let Some(event) = host.session().external.pop_front() else {
            return Ok(None);
        };
        self.select(event, host);
        let taken = !self.filtered.is_empty();
        if taken {
            self.microstep(event, host)?;
        }
        self.macrostep(host)?;
        Ok(Some(Step { event, taken }))
    }

    /// Takes the enabled transitions without events, as after an event that no transition takes.
    ///
    /// # Errors
    /// The machine does not come to rest.
    pub fn rest<H: Host>(&mut self, host: &mut H) -> Result<(), Error> {
        if self.running {
            self.macrostep(host)?;
        }
        Ok(())
    }

    /// When the next delayed event is due, by the clock of [`Host::now`].
    pub fn next_due(&self) -> Option<Duration> {
        self.delayed.front().map(|delayed| delayed.due)
    }

    /// Leaves all active states, the innermost first, and ends the machine.
    pub fn stop<H: Host>(&mut self, host: &mut H) {
        if host.session().ended {
            return;
        }
        self.running = false;
        self.exit_interpreter(host);
    }

    fn macrostep<H: Host>(&mut self, host: &mut H) -> Result<(), Error> {
        let mut microsteps = 0;
        while self.running {
            self.filtered.clear();
            if self.has_eventless {
                self.select(NONE, host);
            }
            let mut event = NONE;
            if self.filtered.is_empty() {
                match self.internal.pop_front() {
                    None => return Ok(()),
                    Some(next) => event = next,
                }
                self.select(event, host);
            }
            if !self.filtered.is_empty() {
                microsteps += 1;
                if microsteps > MAX_MICROSTEPS {
                    return Err(Error::Endless);
                }
                self.microstep(event, host)?;
            }
        }
        self.exit_interpreter(host);
        Ok(())
    }

    fn exit_interpreter<H: Host>(&mut self, host: &mut H) {
        let mut below = self.chart.states.len() as u16;
        while let Some(state) = host.session().active.previous(below) {
            below = state;
            self.exit_state(state, host);
        }
        self.internal.clear();
        self.delayed.clear();
        host.session().ended = true;
        host.session().external.clear();
    }

    /// Moves delayed events that are due into the external queue.
    fn release<H: Host>(&mut self, host: &mut H) {
        if self.delayed.is_empty() {
            return;
        }
        let now = host.now();
        while let Some(delayed) = self.delayed.front().copied() {
            // Events without room are late, never lost.
            if delayed.due > now || host.session().fire(delayed.event).is_err() {
                break;
            }
            self.delayed.pop_front();
        }
    }

    /// `selectTransitions`, or `selectEventlessTransitions` for [`NONE`].
    fn select<H: Host>(&mut self, event: u16, host: &mut H) {
        let chart = self.chart;
        self.enabled.clear();
        let mut next = host.session().next_active(0);
        while let Some(atomic) = next {
            if chart.state(atomic).kind.is_atomic() {
                let mut state = atomic;
                'found: while state != 0 {
                    for at in chart.state(state).transitions.indices() {
                        let at = at as u16;
                        if self.matches(at, event) && self.holds(at, host) {
                            if !self.enabled.contains(&at) {
                                self.enabled.push(at);
                            }
                            break 'found;
                        }
                    }
                    state = chart.state(state).parent;
                }
            }
            next = host.session().next_active(atomic + 1);
        }
        self.remove_conflicting();
    }

    fn matches(&self, transition: u16, event: u16) -> bool {
        match self.chart.transition(transition).trigger {
            Trigger::Eventless => event == NONE,
            Trigger::Any => event != NONE,
            Trigger::Events(events) => self.chart.list(events).contains(&event),
        }
    }

    fn holds<H: Host>(&self, transition: u16, host: &mut H) -> bool {
        match self.chart.transition(transition).condition {
            Condition::Always => true,
            Condition::In(state) => host.session().is_in(state),
            Condition::Guard(guard) => host.guard(guard),
        }
    }

    /// `removeConflictingTransitions`. Domains are ancestors of active states, so two exit sets
    /// intersect if one domain is in the other.
    fn remove_conflicting(&mut self) {
        self.filtered.clear();
        for at in 0..self.enabled.len() {
            let transition = self.enabled[at];
            let domain = self.domain(transition);
            let chart = self.chart;
            let source = |t: u16| chart.transition(t).source;
            let conflicts = |other: u16| {
                domain != NONE
                    && other != NONE
                    && (domain == other
                        || chart.is_descendant(domain, other)
                        || chart.is_descendant(other, domain))
            };
            let preempted = self.filtered.iter().any(|(other, place)| {
                conflicts(*place) && !chart.is_descendant(source(transition), source(*other))
            });
            if !preempted {
                self.filtered.retain(|(_, place)| !conflicts(*place));
                self.filtered.push((transition, domain));
            }
        }
    }

    fn microstep<H: Host>(&mut self, event: u16, host: &mut H) -> Result<(), Error> {
        self.taken.clear();
        self.taken.extend(self.filtered.iter().map(|(t, _)| *t));
        host.begins(event, &self.taken);
        self.exit_states(host);
        for at in 0..self.filtered.len() {
            let actions = self.chart.transition(self.filtered[at].0).actions;
            self.run(actions, host);
        }
        self.enter_states(host);
        host.ends();
        if self.overflow {
            return Err(Error::TooManyRaised);
        }
        Ok(())
    }

    fn exit_states<H: Host>(&mut self, host: &mut H) {
        let chart = self.chart;
        self.exit.clear();
        for (_, domain) in &self.filtered {
            if *domain == NONE {
                continue;
            }
            let end = chart.state(*domain).end;
            let mut next = host.session().next_active(domain + 1);
            while let Some(state) = next.filter(|state| *state < end) {
                self.exit.insert(state);
                next = host.session().next_active(state + 1);
            }
        }
        let bound = chart.states.len() as u16;
        let mut below = bound;
        while let Some(state) = self.exit.previous(below) {
            below = state;
            self.remember(state, host.session());
        }
        below = bound;
        while let Some(state) = self.exit.previous(below) {
            below = state;
            self.exit_state(state, host);
        }
    }

    fn exit_state<H: Host>(&mut self, state: u16, host: &mut H) {
        self.run_blocks(self.chart.state(state).exit, host);
        if host.exit(state).is_err() {
            self.raise(self.chart.execution_error);
        }
        host.session().active.remove(state);
    }

    /// Stores what the history states of a state remember.
    fn remember(&mut self, state: u16, session: &Session) {
        let chart = self.chart;
        for history in chart.list(chart.state(state).histories) {
            let history = chart.state(*history);
            let place = &mut self.history[usize::from(history.history)];
            if place.is_none() {
                *place = self.spare.pop();
            }
            let Some(memory) = place else { continue };
            memory.clear();
            let end = chart.state(state).end;
            let mut next = session.next_active(state + 1);
            while let Some(inner) = next.filter(|inner| *inner < end) {
                let kept = match history.kind {
                    Kind::Deep => chart.state(inner).kind.is_atomic(),
                    _ => chart.state(inner).parent == state,
                };
                if kept {
                    memory.insert(inner);
                }
                next = session.next_active(inner + 1);
            }
        }
    }

    fn run_blocks<H: Host>(&mut self, blocks: Range, host: &mut H) {
        for block in blocks.indices() {
            self.run(self.chart.blocks[block], host);
        }
    }

    /// Runs a block of actions. One that fails ends it.
    fn run<H: Host>(&mut self, actions: Range, host: &mut H) {
        let chart = self.chart;
        for action in &chart.actions[actions.indices()] {
            match *action {
                Action::Raise(event) => self.raise(event),
                Action::Send { event, delay, id } => {
                    if !self.send(event, delay, id, host) {
                        self.raise(chart.communication_error);
                        return;
                    }
                }
                Action::Cancel(id) => self.delayed.retain(|delayed| delayed.id != id),
                Action::Log { label, text } => {
                    let text_of = |at: u16| chart.texts.get(usize::from(at)).map_or("", |t| t);
                    host.log(text_of(label), text_of(text));
                }
                Action::Call(function) => {
                    if host.call(function).is_err() {
                        self.raise(chart.execution_error);
                        return;
                    }
                }
            }
        }
    }

    /// Puts an event into the internal queue.
    fn raise(&mut self, event: u16) {
        if event == NONE {
            return;
        }
        if self.internal.len() < MAX_INTERNAL {
            self.internal.push_back(event);
        } else {
            self.overflow = true;
        }
    }

    /// Says whether there was room.
    fn send<H: Host>(&mut self, event: u16, delay: u64, id: u16, host: &mut H) -> bool {
        if delay == 0 {
            return host.session().fire(event).is_ok();
        }
        if self.delayed.len() >= MAX_DELAYED {
            return false;
        }
        let due = host.now().saturating_add(Duration::from_nanos(delay));
        let at = self.delayed.partition_point(|other| other.due <= due);
        self.delayed.insert(at, Delayed { due, event, id });
        true
    }

    /// `getTransitionDomain`: the state whose descendants the transition leaves.
    fn domain(&self, transition: u16) -> u16 {
        let chart = self.chart;
        let it = chart.transition(transition);
        if !it.through_history {
            return it.domain;
        }
        // The memory of a history state, or its default, decides.
        let inside = |state: u16| {
            let mut all = chart.list(it.targets).iter();
            all.all(|target| self.effective_targets_are_inside(*target, state))
        };
        if it.internal && chart.state(it.source).kind == Kind::Compound && inside(it.source) {
            return it.source;
        }
        let mut outer = chart.ancestors(it.source, NONE);
        outer
            .find(|state| chart.state(*state).kind == Kind::Compound && inside(*state))
            .unwrap_or(0)
    }

    /// Whether all of `getEffectiveTargetStates` are descendants of `outer`.
    fn effective_targets_are_inside(&self, target: u16, outer: u16) -> bool {
        let chart = self.chart;
        let state = chart.state(target);
        if !state.kind.is_history() {
            return chart.is_descendant(target, outer);
        }
        if let Some(memory) = &self.history[usize::from(state.history)] {
            return memory.iter().all(|s| chart.is_descendant(s, outer));
        }
        let default = chart.transition(state.initial).targets;
        let mut all = chart.list(default).iter();
        all.all(|target| self.effective_targets_are_inside(*target, outer))
    }
}
