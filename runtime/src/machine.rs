//! The state machine of a component: its steps in the component's event loop.
//!
//! Generated code has the tables ([`Chart`]) and implements [`Hooks`], which calls the functions of
//! the worker. The worker sees a [`Machine`] as `ctx.machine`.

use crate::clock::Time;
use crate::context::Core;
use crate::fired_event::FiredEvent;
use crate::machine_record::{MachineRecord, TakenTransition};
use crate::worker_error::WorkerError;
pub use rc_machine::{Action, Chart, Condition, Kind, NONE, Range, State, Transition, Trigger};
use rc_machine::{Failed, Host, Interpreter, Session};
use std::collections::VecDeque;
use std::marker::PhantomData;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// The most events that are handled between two turns of the event loop.
const EVENTS_A_TURN: usize = 64;
/// The most transitions that are logged at the level `info` in a second. Others are at `debug`.
const LOGGED_A_SECOND: u32 = 10;

/// The least time between two warnings.
const WARNING_PAUSE: Duration = Duration::from_secs(1);

/// A state or an event of generated code.
pub trait Numbered: Copy {
    /// Number in the chart.
    fn number(self) -> u16;
}

/// The state machine, as the worker sees it.
#[derive(Debug)]
pub struct Machine<S, E> {
    parts: Parts,
    names: PhantomData<(S, E)>,
}

/// A machine without the names of its states and events.
#[derive(Debug)]
pub struct Parts {
    session: Session,
    /// The events that may be fired from outside.
    external: &'static [u16],
    /// Events that tools fire.
    outside: VecDeque<Arc<FiredEvent>>,
    /// Absent while a step runs.
    interpreter: Option<Box<Interpreter>>,
    /// Whether the function that ran last was the empty `during` of the trait.
    no_during: bool,
    logged: u32,
    logged_since: Instant,
    /// When the last warning was logged: of an event, an entry, an exit or an action.
    warned: Option<Instant>,
}

impl<S: Numbered, E: Numbered> Machine<S, E> {
    /// A machine that has not started, and the events that may be fired from outside.
    pub fn new(chart: &'static Chart, external: &'static [u16]) -> Self {
        Self {
            parts: Parts {
                session: Session::new(chart),
                external,
                outside: VecDeque::new(),
                interpreter: Some(Box::new(Interpreter::new(chart))),
                no_during: false,
                logged: 0,
                logged_since: Instant::now(),
                warned: None,
            },
            names: PhantomData,
        }
    }

    /// Puts an event into the machine's queue. The machine handles it after the handlers of a turn
    /// (at most 64), or at the end of the period, after all `during` functions or `compute`. An
    /// event after the end of the machine, or while 256 wait, is dropped, with a warning at most
    /// once a second.
    pub fn fire(&mut self, event: E) {
        self.parts.fire(event.number());
    }

    /// Whether a state is active. Then its ancestors are, too.
    pub fn is_in(&self, state: S) -> bool {
        self.parts.is_in(state.number())
    }

    /// Whether the machine has entered its initial states. The machine of a managed component does
    /// so at its first activation.
    pub fn has_started(&self) -> bool {
        self.parts.has_started()
    }

    /// Whether the machine has reached an end state of its own.
    pub fn has_ended(&self) -> bool {
        self.parts.session.has_ended()
    }

    /// The names of the active states that have no substates, with those of their ancestors, as
    /// `driving.forward`.
    pub fn active(&self) -> Vec<&'static str> {
        self.parts.active().collect()
    }

    /// Interpreter and queue, for generated code.
    #[doc(hidden)]
    pub fn parts(&mut self) -> &mut Parts {
        &mut self.parts
    }

    /// The `during` of a state that the worker did not write.
    #[doc(hidden)]
    pub fn no_during(&mut self) {
        self.parts.no_during = true;
    }
}

/// The events that the runtime fires itself, by their numbers in the chart.
#[derive(Clone, Copy, Debug, Default)]
pub struct MachineEvents {
    /// Fired when the machine has started.
    pub first: Option<u16>,
    /// A state, and the event that is fired at the end of each period in it.
    pub period: Option<(u16, u16)>,
}

impl MachineEvents {
    /// None.
    pub const NONE: Self = Self {
        first: None,
        period: None,
    };
}

impl Parts {
    /// Puts an event into the queue, see [`Machine::fire`].
    pub(crate) fn fire(&mut self, event: u16) {
        if let Err(reason) = self.session.fire(event) {
            let name = &self.session.chart().events[usize::from(event)];
            if self.may_warn() {
                let reason = refusal(reason);
                tracing::warn!("the event {name} is dropped: {reason}");
            }
        }
    }

    /// Whether a state is active.
    pub(crate) fn is_in(&self, state: u16) -> bool {
        self.session.is_in(state)
    }

    /// Whether the machine has entered its initial states.
    pub(crate) fn has_started(&self) -> bool {
        self.session.active().next().is_some() || self.session.has_ended()
    }

    /// The active states, if none of `states` is among them: then requests that these states serve
    /// are refused. A machine without an active state has `ended`, or is `not started`.
    pub(crate) fn unavailable(&self, states: &[u16]) -> Option<String> {
        if states.iter().any(|state| self.is_in(*state)) {
            return None;
        }
        let active: Vec<&str> = self.active().collect();
        if active.is_empty() {
            let ended = self.session.has_ended();
            let state = if ended { "ended" } else { "not started" };
            return Some(state.to_owned());
        }
        Some(active.join(", "))
    }

    fn active(&self) -> impl Iterator<Item = &'static str> + '_ {
        let chart = self.session.chart();
        let states = self.session.active().map(|state| chart.state(state));
        let innermost = states.filter(|state| state.kind.is_atomic());
        innermost.map(|state| &*state.path)
    }

    /// Whether a warning may be logged now: at most one a second.
    fn may_warn(&mut self) -> bool {
        let may = self
            .warned
            .is_none_or(|last| last.elapsed() >= WARNING_PAUSE);
        if may {
            self.warned = Some(Instant::now());
        }
        may
    }

    /// When a delayed event is due.
    pub(crate) fn next_due(&self) -> Option<Time> {
        let due = self.interpreter.as_ref()?.next_due()?;
        let due = u64::try_from(due.as_nanos()).unwrap_or(u64::MAX);
        Some(Time::from_nanos(due))
    }

    /// Whether an event waits that is not delayed.
    pub(crate) fn has_events(&self) -> bool {
        self.session.has_events() || !self.outside.is_empty()
    }

    /// Adds an event that a tool fires. The machine handles it after the events that wait.
    pub(crate) fn fire_from_outside(&mut self, fired: Arc<FiredEvent>) {
        self.outside.retain(|fired| fired.is_queued());
        self.outside.push_back(fired);
    }

    /// Refuses the events of tools that wait: the component is not active.
    pub(crate) fn refuse_outside(&mut self, reason: &str) {
        for fired in self.outside.drain(..).filter(|fired| fired.begin()) {
            fired.end(Err(reason.to_owned()));
        }
    }
}

/// The worker with its context, for the steps of the machine. States, guards and functions are
/// numbers of the chart.
pub trait Hooks {
    /// The machine in the context.
    fn parts(&mut self) -> &mut Parts;
    /// The component.
    fn core(&mut self) -> &mut Core;
    /// Evaluates a guard.
    fn guard(&mut self, guard: u16) -> bool;
    /// Calls an action.
    ///
    /// # Errors
    /// The error of the worker.
    fn action(&mut self, action: u16) -> Result<(), WorkerError>;
    /// Calls the worker on entry of a state.
    ///
    /// # Errors
    /// The error of the worker.
    fn entry(&mut self, state: u16) -> Result<(), WorkerError>;
    /// Calls the worker on exit of a state.
    ///
    /// # Errors
    /// The error of the worker.
    fn exit(&mut self, state: u16) -> Result<(), WorkerError>;
    /// Calls the worker in an active state, once a period.
    ///
    /// # Errors
    /// The error of the worker.
    fn during(&mut self, state: u16) -> Result<(), WorkerError>;
}

/// Enters the initial states.
///
/// # Errors
/// A function of the worker demands it, or the machine does not come to rest.
pub fn start(hooks: &mut impl Hooks) -> Result<(), WorkerError> {
    step(hooks, |interpreter, host| {
        interpreter.start(host)?;
        Ok(())
    })
}

/// Handles the events that wait, as many as one turn of the event loop may. Once none waits, one
/// event that a tool fires follows.
///
/// # Errors
/// A function of the worker demands it, or the machine does not come to rest.
pub fn react(hooks: &mut impl Hooks) -> Result<(), WorkerError> {
    step(hooks, |interpreter, host| {
        for _ in 0..EVENTS_A_TURN {
            if interpreter.step(host)?.is_none() {
                return take_from_outside(interpreter, host);
            }
        }
        Ok(())
    })
}

/// Handles one event that a tool fires, and returns the result. No other event waits, so the step
/// is that of this one; events that it fires itself are handled before the next one from outside.
fn take_from_outside<H: Hooks>(
    interpreter: &mut Interpreter,
    host: &mut Steps<'_, H>,
) -> Result<(), rc_machine::Error> {
    let exact = host.hooks.core().exact.clone();
    if let Some(event) = exact.next_fired() {
        if host.session().fire(event).is_ok() {
            interpreter.step(host)?;
        }
        return Ok(());
    }
    let fired = loop {
        match host.hooks.parts().outside.pop_front() {
            None => return Ok(()),
            Some(fired) if fired.begin() => break fired,
            Some(_) => {}
        }
    };
    exact.fired(fired.event);
    if let Err(reason) = host.session().fire(fired.event) {
        fired.end(Err(refusal(reason).to_owned()));
        return Ok(());
    }
    let stepped = interpreter.step(host);
    let parts = host.hooks.parts();
    let active = || parts.active().collect::<Vec<_>>();
    fired.end(match &stepped {
        Ok(Some(step)) if step.taken => Ok(active().into_iter().map(str::to_owned).collect()),
        Ok(_) => {
            let event = &parts.session.chart().events[usize::from(fired.event)];
            let active = active().join("`, `");
            Err(format!("no transition takes `{event}` in `{active}`"))
        }
        Err(error) => Err(error.to_string()),
    });
    stepped?;
    Ok(())
}

/// Why an event is dropped.
fn refusal(reason: rc_machine::Refused) -> &'static str {
    match reason {
        rc_machine::Refused::Ended => "the machine has ended",
        rc_machine::Refused::Full => "too many events wait",
    }
}

/// Runs the `during` of the active states, parents first. Returns whether no state has one, so that
/// `compute` is to run.
///
/// # Errors
/// The first error of the worker, which ends the period.
pub fn during(hooks: &mut impl Hooks) -> Result<bool, WorkerError> {
    let mut none = true;
    let mut next = hooks.parts().session.next_active(1);
    while let Some(state) = next {
        hooks.parts().no_during = false;
        let result = guarded(hooks, "during", state, |hooks| hooks.during(state));
        none &= std::mem::take(&mut hooks.parts().no_during);
        result?;
        next = hooks.parts().session.next_active(state + 1);
    }
    Ok(none)
}

/// Handles the events that wait, and takes the transitions without events whose guards hold by now.
///
/// # Errors
/// A function of the worker demands it, or the machine does not come to rest.
pub fn rest(hooks: &mut impl Hooks) -> Result<(), WorkerError> {
    step(hooks, |interpreter, host| {
        for _ in 0..EVENTS_A_TURN {
            if interpreter.step(host)?.is_none() {
                break;
            }
        }
        interpreter.rest(host)
    })
}

/// Leaves all active states, because the component ends.
pub fn stop(hooks: &mut impl Hooks) {
    let result = step(hooks, |interpreter, host| {
        interpreter.stop(host);
        Ok(())
    });
    if let Err(error) = result {
        tracing::warn!("the states were left with an error: {error}");
    }
}

/// Runs the interpreter, which is out of the context meanwhile.
fn step<H: Hooks>(
    hooks: &mut H,
    run: impl FnOnce(&mut Interpreter, &mut Steps<'_, H>) -> Result<(), rc_machine::Error>,
) -> Result<(), WorkerError> {
    let Some(mut interpreter) = hooks.parts().interpreter.take() else {
        return Ok(());
    };
    let had_ended = hooks.parts().session.has_ended();
    let mut host = Steps {
        hooks,
        failure: None,
        since: Instant::now(),
        event: NONE,
        transition: None,
    };
    let result = run(&mut interpreter, &mut host);
    let failure = host.failure.take();
    let parts = hooks.parts();
    parts.interpreter = Some(interpreter);
    record(hooks, None);
    let parts = hooks.parts();
    if let Err(error) = result {
        let active: Vec<&str> = parts.active().collect();
        let message = format!("the state machine in {}: {error}", active.join(", "));
        return Err(WorkerError::Fatal(message));
    }
    let end = parts.session.end_state();
    if let (false, true, Some(end)) = (had_ended, parts.session.has_ended(), end) {
        let name = &parts.session.chart().state(end).path;
        let reason = format!("the state machine has reached its end state `{name}`");
        hooks.core().stop(&reason);
    }
    failure.map_or(Ok(()), Err)
}

/// Calls the worker. If it panics, the log names the active states.
fn guarded<H: Hooks, T>(
    hooks: &mut H,
    what: &str,
    state: u16,
    call: impl FnOnce(&mut H) -> T,
) -> T {
    let result = catch_unwind(AssertUnwindSafe(|| call(&mut *hooks)));
    result.unwrap_or_else(|payload| {
        let parts = hooks.parts();
        let chart = parts.session.chart();
        let of = match what {
            "guard" => chart.guards.get(usize::from(state)).map(|name| &**name),
            "action" => chart.functions.get(usize::from(state)).map(|name| &**name),
            _ => chart
                .states
                .get(usize::from(state))
                .map(|state| &*state.path),
        };
        let active: Vec<&str> = parts.active().collect();
        tracing::error!(
            "panic in the {what} `{}`; the active states are: {}",
            of.unwrap_or_default(),
            active.join(", ")
        );
        resume_unwind(payload)
    })
}

/// The host of the interpreter.
struct Steps<'a, H> {
    hooks: &'a mut H,
    /// The first error after which the component cannot just run on.
    failure: Option<WorkerError>,
    since: Instant,
    event: u16,
    transition: Option<u16>,
}

impl<H: Hooks> Steps<'_, H> {
    fn result(&mut self, what: &str, result: Result<(), WorkerError>) -> Result<(), Failed> {
        let Err(error) = result else { return Ok(()) };
        match error {
            WorkerError::Failed(message) => {
                if self.hooks.parts().may_warn() {
                    tracing::warn!("{what}: {message}");
                }
            }
            other @ (WorkerError::Emergency(_) | WorkerError::Fatal(_)) => {
                let worse = matches!(other, WorkerError::Fatal(_))
                    && !matches!(self.failure, Some(WorkerError::Fatal(_)));
                if worse || self.failure.is_none() {
                    self.failure = Some(other);
                }
            }
        }
        Err(Failed)
    }

    fn name(&mut self, state: u16) -> &'static str {
        &self.hooks.parts().session.chart().state(state).path
    }
}

impl<H: Hooks> Host for Steps<'_, H> {
    fn session(&mut self) -> &mut Session {
        &mut self.hooks.parts().session
    }

    fn now(&mut self) -> Duration {
        Duration::from_nanos(self.hooks.core().now().as_nanos())
    }

    fn guard(&mut self, guard: u16) -> bool {
        guarded(self.hooks, "guard", guard, |hooks| hooks.guard(guard))
    }

    fn call(&mut self, function: u16) -> Result<(), Failed> {
        let result = guarded(self.hooks, "action", function, |hooks| {
            hooks.action(function)
        });
        let name = &self.hooks.parts().session.chart().functions[usize::from(function)];
        self.result(&format!("action `{name}`"), result)
    }

    fn enter(&mut self, state: u16) -> Result<(), Failed> {
        let result = guarded(self.hooks, "entry", state, |hooks| hooks.entry(state));
        if result.is_ok() {
            return Ok(());
        }
        let name = self.name(state);
        self.result(&format!("entry of `{name}`"), result)
    }

    fn exit(&mut self, state: u16) -> Result<(), Failed> {
        let result = guarded(self.hooks, "exit", state, |hooks| hooks.exit(state));
        if result.is_ok() {
            return Ok(());
        }
        let name = self.name(state);
        self.result(&format!("exit of `{name}`"), result)
    }

    fn log(&mut self, label: &str, text: &str) {
        let separator = if label.is_empty() || text.is_empty() {
            ""
        } else {
            ": "
        };
        tracing::info!("{label}{separator}{text}");
    }

    fn begins(&mut self, event: u16, transitions: &[u16]) {
        self.since = Instant::now();
        self.event = event;
        let chart = self.hooks.parts().session.chart();
        let mut transitions = transitions.iter().copied();
        self.transition = transitions.find(|t| !chart.transition(*t).targets.is_empty());
    }

    fn ends(&mut self) {
        let took = self.since.elapsed();
        let Some(number) = self.transition else {
            return;
        };
        let event = self.event;
        let chart = self.hooks.parts().session.chart();
        let transition = chart.transition(number);
        let taken = TakenTransition {
            transition: number,
            event,
            took,
            at: self.hooks.core().shared.uptime(),
        };
        record(self.hooks, Some(taken));
        let parts = self.hooks.parts();
        if parts.logged_since.elapsed() >= Duration::from_secs(1) {
            parts.logged_since = Instant::now();
            parts.logged = 0;
        }
        parts.logged = parts.logged.saturating_add(1);
        if parts.logged > LOGGED_A_SECOND && !tracing::enabled!(tracing::Level::DEBUG) {
            return;
        }
        let from = &chart.state(transition.source).path;
        let by = chart.events.get(usize::from(event)).map_or("", |name| name);
        let active: Vec<&str> = parts.active().collect();
        let active = active.join(", ");
        if parts.logged <= LOGGED_A_SECOND {
            tracing::info!("{from} => {active} [{by}] in {took:?}");
        } else {
            tracing::debug!("{from} => {active} [{by}] in {took:?}");
        }
    }
}

/// Notes the active states, and a transition that was taken, for the status.
fn record<H: Hooks>(hooks: &mut H, taken: Option<TakenTransition>) {
    let shared = Arc::clone(&hooks.core().shared);
    let parts = hooks.parts();
    let (external, session) = (parts.external, &parts.session);
    let mut status = shared.status();
    let record = status
        .machine
        .get_or_insert_with(|| MachineRecord::new(session.chart(), external));
    record.update(session, taken);
}

#[cfg(test)]
mod tests;
