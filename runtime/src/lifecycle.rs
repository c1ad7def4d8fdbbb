//! The life cycle of a managed component: its state, the requests that wait for the thread of the
//! worker, and the steps of a transition.

use crate::waker::Waker;
use crate::worker_error::WorkerError;
use rc_diagnostics::foreign;
use rc_lifecycle::Outcome;
pub use rc_lifecycle::{LifecycleState, Transition};
use rc_management::link::LifecycleReport;
use rc_middleware::WakeEvent;
use rc_middleware::lifecycle::{LifecycleChange, LifecycleListener, LifecycleService};
use rc_middleware::typed::Gate;
use std::collections::VecDeque;
use std::sync::atomic::{AtomicU8, Ordering};
use std::sync::mpsc::sync_channel;
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::{Duration, Instant};

/// How long a request waits for the end of its transition.
pub(crate) const LIMIT: Duration = Duration::from_mins(1);

/// The most requests that wait.
const MOST_WAITING: usize = 16;

/// Hook of the worker: a function of its trait `Worker`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Hook<'a> {
    /// The function that has the name of the transition.
    Transition(Transition),
    /// `error`, after the function of this transition has failed for this reason.
    Error(Transition, &'a str),
}

/// Why a transition has not succeeded.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Missed {
    /// The state now.
    pub state: LifecycleState,
    /// The reason, with the name of the transition.
    pub reason: String,
    /// Whether the component has to end.
    pub is_fatal: bool,
}

impl std::fmt::Display for Missed {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}; the component is {} now", self.reason, self.state)
    }
}

impl std::error::Error for Missed {}

/// Receives the result of a request, on the thread of the worker.
type Done = Box<dyn FnOnce(Result<LifecycleState, String>) + Send>;

/// A request for a transition.
pub(crate) struct Request {
    pub(crate) transition: Transition,
    until: Instant,
    done: Done,
}

impl Request {
    /// Hands over the result.
    pub(crate) fn end(self, result: Result<LifecycleState, String>) {
        (self.done)(result);
    }

    /// Whether its requester waits no more.
    pub(crate) fn is_late(&self) -> bool {
        Instant::now() >= self.until
    }
}

/// Ends a life cycle when it is dropped: no requester waits for a component that failed to start.
pub(crate) struct EndsWhenDropped(pub(crate) Arc<Lifecycle>);

impl Drop for EndsWhenDropped {
    fn drop(&mut self) {
        self.0.end();
    }
}

/// A state to which the life cycle is to be brought.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Goal {
    pub(crate) state: LifecycleState,
    /// The number that the supervisor gave it. A component that has none starts by itself
    /// (`--active`), and ends if it misses the goal.
    pub(crate) number: Option<u64>,
}

/// Task that waits for the thread of the worker.
pub(crate) enum Task {
    Transition(Request),
    Goal(Goal),
}

/// The life cycle, which the threads of a component share.
pub(crate) struct Lifecycle {
    state: AtomicU8,
    /// Open from the beginning of `activate` to the end of `deactivate`.
    gate: Gate,
    inner: Mutex<Inner>,
    worker: WakeEvent,
    management: OnceLock<Waker>,
}

#[derive(Default)]
struct Inner {
    requests: VecDeque<Request>,
    goal: Option<Goal>,
    /// The last goal of the supervisor that was reached or missed, and why it was missed.
    done: u64,
    error: Option<String>,
    listeners: Vec<LifecycleListener>,
    /// The component takes no more requests.
    has_ended: bool,
}

impl std::fmt::Debug for Lifecycle {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_tuple("Lifecycle").field(&self.state()).finish()
    }
}

impl Lifecycle {
    /// The life cycle of a component that is unconfigured. `worker` wakes the thread of its worker.
    pub(crate) fn new(worker: WakeEvent) -> Self {
        let gate = Gate::default();
        gate.set_open(false);
        Self {
            state: AtomicU8::new(LifecycleState::Unconfigured as u8),
            gate,
            inner: Mutex::default(),
            worker,
            management: OnceLock::new(),
        }
    }

    /// Wakes the management thread after each change from now on.
    pub(crate) fn report_to(&self, management: Waker) {
        let _ = self.management.set(management);
    }

    /// Gate of the component's publishers.
    pub(crate) fn gate(&self) -> Gate {
        self.gate.clone()
    }

    /// The state.
    pub(crate) fn state(&self) -> LifecycleState {
        let number = self.state.load(Ordering::Relaxed);
        let found = LifecycleState::ALL.iter().find(|s| **s as u8 == number);
        found.copied().unwrap_or(LifecycleState::Unconfigured)
    }

    /// Whether `compute()` and the handlers run.
    pub(crate) fn is_active(&self) -> bool {
        self.state.load(Ordering::Relaxed) == LifecycleState::Active as u8
    }

    /// The report to the supervisor.
    pub(crate) fn report(&self) -> LifecycleReport {
        let inner = self.inner();
        LifecycleReport {
            state: self.state(),
            done: inner.done,
            error: inner.error.clone(),
        }
    }

    /// Adds a request, which must begin before `until`. `done` gets its result on the thread of the
    /// worker.
    ///
    /// # Errors
    /// The component ends, or too many requests wait.
    pub(crate) fn request(
        &self,
        transition: Transition,
        until: Instant,
        done: Done,
    ) -> Result<(), String> {
        let mut inner = self.inner();
        if inner.has_ended {
            return Err("the component ends".to_owned());
        }
        if inner.requests.len() >= MOST_WAITING {
            return Err(format!("{MOST_WAITING} other transitions wait"));
        }
        inner.requests.push_back(Request {
            transition,
            until,
            done,
        });
        drop(inner);
        self.worker.wake();
        Ok(())
    }

    /// Sets the state to which the life cycle is to be brought. It takes the place of one that
    /// waits.
    pub(crate) fn set_goal(&self, goal: Goal) {
        self.inner().goal = Some(goal);
        self.worker.wake();
    }

    /// Notes that a goal of the supervisor was reached or missed.
    pub(crate) fn goal_ended(&self, number: u64, error: Option<&str>) {
        let mut inner = self.inner();
        inner.done = number;
        // The reason is the worker's text, of any length.
        inner.error = error.map(foreign::clean);
        drop(inner);
        self.wake_management();
    }

    /// The next task of the worker's thread.
    pub(crate) fn next(&self) -> Option<Task> {
        let mut inner = self.inner();
        let request = inner.requests.pop_front().map(Task::Transition);
        request.or_else(|| inner.goal.take().map(Task::Goal))
    }

    /// Refuses requests from now on: the component ends.
    pub(crate) fn end(&self) {
        let requests = {
            let mut inner = self.inner();
            inner.has_ended = true;
            std::mem::take(&mut inner.requests)
        };
        for request in requests {
            request.end(Err("the component ends".to_owned()));
        }
    }

    /// Takes a transition: `run` calls the worker. Runs on the thread of the worker.
    ///
    /// # Errors
    /// The transition is not possible in this state, or its hook has failed.
    pub(crate) fn take(
        &self,
        transition: Transition,
        mut run: impl FnMut(Hook<'_>) -> Result<(), WorkerError>,
    ) -> Result<LifecycleState, Missed> {
        let before = self.state();
        let Some(between) = before.begin(transition) else {
            return Err(Missed {
                state: before,
                reason: format!("{transition}: not possible for a component that is {before}"),
                is_fatal: false,
            });
        };
        self.enter(between);
        let Err(error) = run(Hook::Transition(transition)) else {
            self.enter(between.end(Outcome::Success));
            return Ok(self.state());
        };
        let mut is_fatal = matches!(error, WorkerError::Fatal(_));
        let mut reason = format!("{transition}: {error}");
        tracing::error!("{reason}");
        if matches!(error, WorkerError::Failed(_)) {
            self.enter(between.end(Outcome::Failure));
        } else {
            self.enter(between.end(Outcome::Error));
            let outcome = match run(Hook::Error(transition, &error.to_string())) {
                Ok(()) => Outcome::Success,
                Err(second) => {
                    is_fatal |= matches!(second, WorkerError::Fatal(_));
                    reason = format!("{reason}; error: {second}");
                    tracing::error!("error: {second}");
                    Outcome::Failure
                }
            };
            self.enter(LifecycleState::ErrorProcessing.end(outcome));
        }
        Err(Missed {
            state: self.state(),
            reason,
            is_fatal,
        })
    }

    /// Takes the transitions that lead to `goal`, a primary state.
    ///
    /// # Errors
    /// The first transition that has not succeeded.
    pub(crate) fn go_to(
        &self,
        goal: LifecycleState,
        mut run: impl FnMut(Hook<'_>) -> Result<(), WorkerError>,
    ) -> Result<LifecycleState, Missed> {
        while let Some(transition) = self.state().towards(goal) {
            self.take(transition, &mut run)?;
        }
        let state = self.state();
        if state == goal {
            return Ok(state);
        }
        Err(Missed {
            state,
            reason: format!("no transition leads from {state} to {goal}"),
            is_fatal: false,
        })
    }

    /// Takes a component that ends to finalized, and refuses requests from now on. After a hook
    /// that fails, `shutdown` follows.
    pub(crate) fn finish(&self, mut run: impl FnMut(Hook<'_>) -> Result<(), WorkerError>) {
        self.end();
        if self.go_to(LifecycleState::Finalized, &mut run).is_err() {
            let _ = self.take(Transition::Shutdown, &mut run);
        }
    }

    fn enter(&self, to: LifecycleState) {
        let from = self.state();
        match to {
            LifecycleState::Activating => self.gate.set_open(true),
            LifecycleState::Unconfigured
            | LifecycleState::Inactive
            | LifecycleState::Finalized
            | LifecycleState::ErrorProcessing => self.gate.set_open(false),
            // Activating has opened the gate for `Active`. The other states keep it until their hook
            // has ended.
            LifecycleState::Active
            | LifecycleState::Configuring
            | LifecycleState::CleaningUp
            | LifecycleState::Deactivating
            | LifecycleState::ShuttingDown => {}
        }
        self.state.store(to as u8, Ordering::Relaxed);
        if to.is_primary() {
            tracing::info!("life cycle: {to}");
        } else {
            tracing::debug!("life cycle: {to}");
        }
        // A listener may ask for the life cycle, so the lock is free while it runs.
        let listeners = self.inner().listeners.clone();
        for listener in listeners {
            listener(LifecycleChange { from, to });
        }
        self.wake_management();
    }

    fn wake_management(&self) {
        if let Some(management) = self.management.get() {
            management.wake();
        }
    }

    fn inner(&self) -> MutexGuard<'_, Inner> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// For backends, whose threads call it.
#[derive(Debug)]
pub(crate) struct Service(pub(crate) Arc<Lifecycle>);

impl LifecycleService for Service {
    fn state(&self) -> LifecycleState {
        self.0.state()
    }

    fn change(&self, transition: Transition, asked: Instant) -> Result<LifecycleState, String> {
        let until = asked + LIMIT;
        let left = until.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return Err(too_late(transition, self.0.state()));
        }
        let (answer, answered) = sync_channel(1);
        let done = move |result| drop(answer.try_send(result));
        self.0.request(transition, until, Box::new(done))?;
        let result = answered.recv_timeout(left);
        result.unwrap_or_else(|_| Err(too_late(transition, self.0.state())))
    }

    fn watch(&self, listener: LifecycleListener) {
        self.0.inner().listeners.push(listener);
    }
}

/// The answer to a request whose transition has not ended in time.
pub(crate) fn too_late(transition: Transition, state: LifecycleState) -> String {
    format!("{transition} has not ended within {LIMIT:?}; the component is {state}")
}

#[cfg(test)]
mod tests;
