//! A worker under test with its context, its time and its life cycle.

use super::{Configured, Parts, TestBed, configured};
use crate::adapter::{self, Pair};
use crate::clock::Time;
use crate::description::Description;
use crate::dispatch::{Dispatch, WorkerContext};
use crate::error::StartError;
use crate::lifecycle::{LifecycleState, Missed, Transition};
use crate::ports::Ports;
use crate::worker_error::WorkerError;
use rc_configuration::Values;
use rc_management::component::State as ComponentState;
use std::ops::{Deref, DerefMut};
use std::time::Duration;

/// The context of a worker under test. It dereferences to the context `C`, and the `TestContext` of
/// generated code, which has the fake peers, dereferences to it.
pub struct Bench<C> {
    ctx: C,
    bed: TestBed,
    ports: Ports,
}

impl<C: WorkerContext> Bench<C> {
    /// A context with these parameters.
    ///
    /// # Errors
    /// The context cannot be made of them, or the system has no free descriptor.
    pub fn new(description: &'static Description, values: &Values) -> Result<Self, StartError> {
        let Parts { bed, core, ports } = TestBed::parts(description)?;
        let ctx = C::open(core, &ports, values)?;
        Ok(Self { ctx, bed, ports })
    }

    /// A context with the parameters and the period of `etc/config.toml`, which is checked as when
    /// the component starts.
    ///
    /// # Errors
    /// Those of the check, and of [`Bench::new`].
    pub fn configured(description: &'static Description) -> Result<Self, StartError> {
        let Configured { values, period } = configured(description)?;
        let mut bench = Self::new(description, &values)?;
        if let Some(period) = period {
            bench.ctx.set_period(period);
        }
        Ok(bench)
    }

    /// A context with the default values of its parameters.
    ///
    /// # Panics
    /// If the context cannot be made of them, or the system has no descriptor left.
    pub fn without_configuration(description: &'static Description) -> Self {
        match Self::new(description, &Values::default()) {
            Ok(bench) => bench,
            Err(error) => panic!("{error}"),
        }
    }

    /// For the fake peers.
    #[doc(hidden)]
    pub fn bed(&self) -> &TestBed {
        &self.bed
    }

    /// Creates the worker. No member can be opened afterwards, and the open members must be those
    /// that the test has listed. The state machine starts, unless the component is managed.
    ///
    /// # Errors
    /// Those of the worker, and other members than the listed ones.
    pub fn start<W: 'static>(&mut self) -> Result<W, StartError>
    where
        C: Dispatch<W>,
    {
        let mut worker = (C::WORKER.initialize)(&mut self.ctx)?;
        let mut pair = Pair {
            worker: &mut worker,
            ctx: &mut self.ctx,
        };
        adapter::begin(&mut pair, C::DESCRIPTION.managed, &self.ports)?;
        Ok(worker)
    }

    /// Takes the worker of a managed component through a transition of its life cycle, as its
    /// process does, and returns the state afterwards. The worker is unconfigured at first.
    ///
    /// # Errors
    /// The transition is not possible in this state, or its function has failed.
    pub fn transition<W: 'static>(
        &mut self,
        worker: &mut W,
        transition: Transition,
    ) -> Result<LifecycleState, Missed>
    where
        C: Dispatch<W>,
    {
        let ctx = &mut self.ctx;
        let mut pair = Pair { worker, ctx };
        self.bed
            .take(transition, |hook| adapter::run_hook(&mut pair, hook))
    }

    /// Runs the worker for this time, as its process does: `compute` now and after each period, and
    /// in the state Emergency, into which `WorkerError::Emergency` leads, `emergency` in its place.
    /// Ends when the worker stops the component. A `compute` that fails otherwise ends the run with
    /// its error. A state machine takes its steps, too; while a managed component is not active,
    /// only time passes.
    ///
    /// # Errors
    /// The error of `compute`.
    pub fn run<W: 'static>(&mut self, worker: &mut W, time: Duration) -> Result<(), WorkerError>
    where
        C: Dispatch<W>,
    {
        let ctx = &mut self.ctx;
        let bed = &self.bed;
        bed.run(
            &mut Pair { worker, ctx },
            time,
            |pair| (C::WORKER.emergency)(pair.worker, pair.ctx),
            |pair, slot, member| {
                adapter::end_call(&mut *pair.worker, &mut *pair.ctx, slot, member).is_some()
            },
        )
    }

    /// Lets the worker handle the calls that it started and that have ended, as its process does
    /// between two periods. Returns how many. A fake server answers a started call when it begins.
    /// [`Bench::run`] does this after each period.
    pub fn end_calls<W: 'static>(&mut self, worker: &mut W) -> usize
    where
        C: Dispatch<W>,
    {
        let ctx = &mut self.ctx;
        self.bed.end_calls(|slot, member| {
            adapter::end_call(&mut *worker, &mut *ctx, slot, member).is_some()
        })
    }

    /// Lists the members of a slot array, as `slots` in a .ddsl does, before the worker opens them.
    ///
    /// # Panics
    /// The component has no such array.
    pub fn list_members(&mut self, array: &str, members: &[&str]) {
        self.bed.list_members(array, members);
    }

    /// Moves the time of `ctx.now()` forward. It begins at zero.
    pub fn advance(&mut self, step: Duration) {
        self.bed.advance(step);
    }

    /// Sets the time of `ctx.now()`, possibly to an earlier one.
    pub fn set_time(&mut self, time: Time) {
        self.bed.set_time(time);
    }

    /// Sets what `ctx.state()` returns. It is `Running` otherwise.
    pub fn set_state(&mut self, state: ComponentState) {
        self.bed.set_state(state);
    }
}

impl<C> Deref for Bench<C> {
    type Target = C;

    fn deref(&self) -> &C {
        &self.ctx
    }
}

impl<C> DerefMut for Bench<C> {
    fn deref_mut(&mut self) -> &mut C {
        &mut self.ctx
    }
}
