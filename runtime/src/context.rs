//! The part of a worker's context that is equal in all components. Generated contexts dereference
//! to it.

use crate::clock::{Clock, Time};
use crate::exact::entry::Kind;
use crate::exact::mode::Exact;
use crate::freshness::{Inputs, Moments};
use crate::latest_values::LatestValues;
use crate::lifecycle::{Lifecycle, LifecycleState};
use crate::own_changes::OwnChanges;
use crate::status::Shared;
use rc_configuration::model::Value;
use rc_management::component::{ClockKind, State, WorldStatus};
use std::cell::RefCell;
use std::hash::{BuildHasher, RandomState};
use std::rc::Rc;
use std::sync::Arc;
use std::time::Duration;

/// The running component, as its worker sees it.
///
/// ```ignore
/// fn compute(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
///     tracing::info!("{} runs every {:?}", ctx.name(), ctx.period());
///     Ok(())
/// }
/// ```
#[derive(Debug)]
pub struct Core {
    name: String,
    network: String,
    pub(crate) shared: Arc<Shared>,
    pub(crate) new_period: Option<Duration>,
    pub(crate) fatal: Option<String>,
    clock: Arc<dyn Clock>,
    pub(crate) exact: Exact,
    random: fastrand::Rng,
    /// The newest samples, and those that wait to be collected.
    pub(crate) inputs: Rc<RefCell<Inputs>>,
    /// The last values, which answer queries.
    pub(crate) latest: Rc<RefCell<LatestValues>>,
    pub(crate) own_changes: OwnChanges,
}

/// Reports the state of a component's replica of the shared world to the supervisor and tools.
#[derive(Clone, Debug)]
pub struct WorldReport(Arc<Shared>);

impl WorldReport {
    /// Reports it with the next heartbeat and all later ones.
    pub fn set(&self, status: WorldStatus) {
        self.0.status().world = Some(status);
    }
}

/// The clock of [`Core::now`], for objects that a context owns.
#[derive(Clone, Debug)]
pub struct RecordedClock {
    exact: Exact,
    clock: Arc<dyn Clock>,
}

impl RecordedClock {
    /// The time of the network. An exact recording keeps it, as that of [`Core::now`].
    pub fn now(&self) -> Time {
        self.exact.now(|| self.clock.now())
    }
}

impl Core {
    /// A component whose life is neither recorded nor repeated.
    pub(crate) fn new(name: &str, network: &str, shared: Arc<Shared>, seed: u64) -> Self {
        Self::exact(name, network, shared, Exact::Off, seed)
    }

    pub(crate) fn exact(
        name: &str,
        network: &str,
        shared: Arc<Shared>,
        exact: Exact,
        seed: u64,
    ) -> Self {
        let clock = Arc::clone(&shared.time.clock);
        Self {
            name: name.to_owned(),
            network: network.to_owned(),
            shared,
            new_period: None,
            fatal: None,
            clock,
            exact,
            random: fastrand::Rng::with_seed(seed),
            inputs: Rc::default(),
            latest: Rc::default(),
            own_changes: OwnChanges::Repeated,
        }
    }

    /// The time by which the ages of values are counted.
    pub(crate) fn moments(&self) -> Moments {
        let is_simulated = self.shared.time.kind != ClockKind::System;
        Moments {
            exact: self.exact.clone(),
            simulated: is_simulated.then(|| Arc::clone(&self.clock)),
        }
    }

    /// The name of this component in its network.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Whether this run repeats an exact recording, as `rcdeploy replay` does.
    pub fn is_replay(&self) -> bool {
        self.exact.replay().is_some()
    }

    /// The network's name.
    pub fn network(&self) -> &str {
        &self.network
    }

    /// The time of the network's clock: that of the system, unless another component or a topic
    /// of its middleware provides it. Simulated time stands while a handler or `compute()` runs;
    /// before the first tick it is zero.
    ///
    /// ```no_run
    /// # fn compute(core: &mut rc_runtime::Core, last: &mut rc_runtime::Time) {
    /// let passed = core.now() - *last;
    /// *last = core.now();
    /// # }
    /// ```
    pub fn now(&self) -> Time {
        self.exact.now(|| self.clock.now())
    }

    /// Random numbers for the worker. An exact recording keeps their seed, so that a repeated run
    /// has the same numbers. In simulated time the seed is derived from the component's name: every
    /// run of the network has the same numbers.
    ///
    /// ```no_run
    /// # fn compute(core: &mut rc_runtime::Core) {
    /// let noise = core.random().f64() - 0.5;
    /// let side = core.random().bool();
    /// let index = core.random().usize(0..10);
    /// # let _ = (noise, side, index);
    /// # }
    /// ```
    pub fn random(&mut self) -> &mut fastrand::Rng {
        &mut self.random
    }

    /// A number that no other component and no other run has, in simulated time, too. An exact
    /// recording keeps it.
    pub fn unique(&self) -> u64 {
        let number = || RandomState::new().hash_one(std::process::id());
        self.exact.number(Kind::Unique, number)
    }

    /// The files of the schema of the network's shared world, if it has more than that of the
    /// component: names and texts, beginning with the one that the network names. Otherwise empty.
    pub fn world_schema(&self) -> Vec<(String, String)> {
        self.shared.status().schema.clone()
    }

    /// Gives tools the files of the schema of the component's shared world, names and texts,
    /// beginning with the one that the component names.
    pub fn set_world_schema(&self, files: &[(&str, &str)]) {
        let files = files.iter();
        let files = files.map(|(name, text)| ((*name).to_owned(), (*text).to_owned()));
        self.shared.status().schema = files.collect();
    }

    /// Where to tell how the component's replica of the shared world is.
    pub fn world_report(&self) -> WorldReport {
        WorldReport(Arc::clone(&self.shared))
    }

    /// The clock of [`Core::now`], for other threads of the worker. An exact recording does not
    /// keep their readings.
    pub fn clock(&self) -> Arc<dyn Clock> {
        Arc::clone(&self.clock)
    }

    /// The clock of [`Core::now`], for objects that the context owns, on the thread of the worker.
    pub fn recorded_clock(&self) -> RecordedClock {
        RecordedClock {
            exact: self.exact.clone(),
            clock: Arc::clone(&self.clock),
        }
    }

    /// The state of this component.
    pub fn state(&self) -> State {
        self.shared.status().state
    }

    /// The state of its life cycle; none for a component that is not managed.
    pub fn lifecycle(&self) -> Option<LifecycleState> {
        self.shared.lifecycle.as_deref().map(Lifecycle::state)
    }

    /// The period of `compute()`, by the network's clock.
    pub fn period(&self) -> Duration {
        self.new_period
            .unwrap_or_else(|| self.shared.status().period)
    }

    /// Sets the period of `compute()`, from its next run on; at least 100 µs.
    ///
    /// ```no_run
    /// # fn initialize(core: &mut rc_runtime::Core) {
    /// core.set_period(std::time::Duration::from_millis(20));
    /// # }
    /// ```
    pub fn set_period(&mut self, period: Duration) {
        self.new_period = Some(period);
    }

    /// Requests a change of a parameter of this component, by its path: `range`, `motors[2].max`. The rest is
    /// that of `rcdeploy params set`: the value is checked against the `.pdsl`, `params_changed` accepts or
    /// refuses it, and then `ctx.params` and all tools have the new value. This is done before the next `compute`, in
    /// lockstep in the same tick; a change of several components that is under way delays it. The log and the last
    /// error of the component have a refusal. At most 64 changes wait.
    ///
    /// ```no_run
    /// # fn compute(core: &mut rc_runtime::Core) {
    /// core.set_parameter("range", 2000);
    /// core.set_parameter("motors[2].max", 1.5);
    /// core.set_parameter("pause", std::time::Duration::from_millis(20));
    /// # }
    /// ```
    pub fn set_parameter(&mut self, path: &str, value: impl Into<Value>) {
        if let Err(reason) = self.own_changes.request(path, value.into()) {
            self.shared.refuse_own_change(path, &reason);
        }
    }

    /// Takes the changes that a worker under test has requested, by [`Core::set_parameter`]: paths and values, in
    /// their order. Nothing checks them, and `ctx.params` stays. A process has none here.
    pub fn take_requested_parameters(&mut self) -> Vec<(String, Value)> {
        match &mut self.own_changes {
            OwnChanges::Kept(kept) => std::mem::take(kept),
            OwnChanges::Requested(_) | OwnChanges::Repeated => Vec::new(),
        }
    }

    /// Ends this component in order: the present call returns, then `finalize` runs. The log gets
    /// the reason.
    ///
    /// ```no_run
    /// # fn compute(core: &mut rc_runtime::Core, samples: u32) {
    /// if samples == 100 {
    ///     core.stop("all samples are there");
    /// }
    /// # }
    /// ```
    pub fn stop(&mut self, reason: &str) {
        tracing::info!("stopping: {reason}");
        self.exact.stop(reason);
        self.shared.wake_event.stop();
    }

    /// Ends this component as [`WorkerError::Fatal`](crate::WorkerError::Fatal) does, with exit
    /// code 3, from a function that returns no such error: a handler, `emergency`, `restore` or
    /// `finalize`. The first reason counts.
    ///
    /// ```no_run
    /// # fn emergency(core: &mut rc_runtime::Core, brake_is_hot: bool) {
    /// if brake_is_hot {
    ///     core.fail("the brake is hot");
    /// }
    /// # }
    /// ```
    pub fn fail(&mut self, reason: &str) {
        self.fatal.get_or_insert_with(|| reason.to_owned());
    }

    /// Whether the component is to end. Long work in a handler or in `compute()` should look at it.
    pub fn is_stopping(&self) -> bool {
        self.exact
            .is_stopping(|| self.shared.wake_event.is_stopping())
    }
}

#[cfg(test)]
mod tests {
    use super::Core;
    use crate::clock::SimulatedClock;
    use crate::status::{NetworkTime, Shared};
    use rc_management::component::ClockKind;
    use rc_middleware::WakeEvent;
    use std::sync::Arc;
    use std::time::Duration;

    #[test]
    fn two_runs_in_simulated_time_have_equal_random_numbers_and_another_unique_one() {
        let run = || {
            let time = NetworkTime::new(ClockKind::Simulated, Arc::<SimulatedClock>::default());
            let wake = WakeEvent::new().expect("an event");
            let shared = Arc::new(Shared::new(wake, Duration::from_millis(1), 0, time, false));
            let mut core = Core::new("finder", "home", shared, 5);
            (core.random().u64(..), core.unique())
        };
        let [first, second] = [run(), run()];
        assert_eq!(first.0, second.0);
        assert_ne!(first.1, second.1);
    }
}
