//! The functions of a worker that the runtime calls.

use crate::lifecycle::Transition;
use crate::worker_error::WorkerError;
use rc_configuration::ParamChange;

/// The worker of a component, over its context `C`, which generated code declares. The runtime
/// calls all functions on one thread. It logs and counts an error of `compute` and continues with
/// the next period.
///
/// ```
/// use rc_runtime::{Core, Worker, WorkerError};
///
/// struct Counter(u32);
///
/// impl Worker<Core> for Counter {
///     fn initialize(_: &mut Core) -> Result<Self, WorkerError> {
///         Ok(Self(0))
///     }
///
///     fn compute(&mut self, core: &mut Core) -> Result<(), WorkerError> {
///         self.0 += 1;
///         if self.0 == 100 {
///             core.stop("all rounds are done");
///         }
///         Ok(())
///     }
/// }
/// ```
pub trait Worker<C>: Sized {
    /// Creates the worker when its clients and publishers are open.
    fn initialize(ctx: &mut C) -> Result<Self, WorkerError>;

    /// Runs once a period; in a component with a state machine, while no active state has a
    /// `during`.
    fn compute(&mut self, ctx: &mut C) -> Result<(), WorkerError> {
        let _ = ctx;
        Ok(())
    }

    /// Runs after parameters of the running component changed, with all changes of one request.
    /// `ctx.params` holds the new values. Return an error to reject the request: the requester
    /// receives it, and `ctx.params` gets the old values back.
    fn params_changed(&mut self, ctx: &mut C, changes: &[ParamChange]) -> Result<(), WorkerError> {
        let _ = (ctx, changes);
        Ok(())
    }

    /// Runs once a period instead of `compute`, while the component is in the state Emergency.
    fn emergency(&mut self, ctx: &mut C) {
        let _ = ctx;
    }

    /// Runs once when the state Emergency ends.
    fn restore(&mut self, ctx: &mut C) {
        let _ = ctx;
    }

    /// Runs once before the component ends. It can still send commands and publish, for example to
    /// stop motors. A query returns `CallError::Stopping` while the component stops.
    fn finalize(&mut self, ctx: &mut C) {
        let _ = ctx;
    }
}

/// The worker of a managed component (`lifecycle managed`): [`Worker`] with the functions of its
/// life cycle. Its generated crate exports this trait as `Worker`.
///
/// ```
/// use rc_runtime::{Core, ManagedWorker, WorkerError};
///
/// struct Driver {
///     is_open: bool,
/// }
///
/// impl ManagedWorker<Core> for Driver {
///     fn initialize(_: &mut Core) -> Result<Self, WorkerError> {
///         Ok(Self { is_open: false })
///     }
///
///     fn configure(&mut self, _: &mut Core) -> Result<(), WorkerError> {
///         self.is_open = true;
///         Ok(())
///     }
///
///     fn cleanup(&mut self, _: &mut Core) -> Result<(), WorkerError> {
///         self.is_open = false;
///         Ok(())
///     }
/// }
/// ```
pub trait ManagedWorker<C>: Sized {
    /// As [`Worker::initialize`].
    fn initialize(ctx: &mut C) -> Result<Self, WorkerError>;

    /// As [`Worker::compute`], while the component is active.
    fn compute(&mut self, ctx: &mut C) -> Result<(), WorkerError> {
        let _ = ctx;
        Ok(())
    }

    /// As [`Worker::params_changed`].
    fn params_changed(&mut self, ctx: &mut C, changes: &[ParamChange]) -> Result<(), WorkerError> {
        let _ = (ctx, changes);
        Ok(())
    }

    /// As [`Worker::emergency`].
    fn emergency(&mut self, ctx: &mut C) {
        let _ = ctx;
    }

    /// As [`Worker::restore`].
    fn restore(&mut self, ctx: &mut C) {
        let _ = ctx;
    }

    /// Prepares for work: opens devices, reserves memory. The component is inactive afterwards.
    /// After `WorkerError::Failed` it is unconfigured as before; after `WorkerError::Emergency`,
    /// `error` follows. The same holds for the next functions, with their own initial states.
    fn configure(&mut self, ctx: &mut C) -> Result<(), WorkerError> {
        let _ = ctx;
        Ok(())
    }

    /// Begins to work. Samples that it publishes are sent, those of `configure` are not. Afterwards
    /// the component is active: `compute` and the handlers run.
    fn activate(&mut self, ctx: &mut C) -> Result<(), WorkerError> {
        let _ = ctx;
        Ok(())
    }

    /// Ends its work. It can publish a last time. The component is inactive afterwards.
    fn deactivate(&mut self, ctx: &mut C) -> Result<(), WorkerError> {
        let _ = ctx;
        Ok(())
    }

    /// Gives back what `configure` has taken. The component is unconfigured afterwards.
    fn cleanup(&mut self, ctx: &mut C) -> Result<(), WorkerError> {
        let _ = ctx;
        Ok(())
    }

    /// Runs once before the component is finalized, in which it only waits for its end. A component
    /// that is asked to end while it is active runs `deactivate` and `cleanup` before.
    fn shutdown(&mut self, ctx: &mut C) -> Result<(), WorkerError> {
        let _ = ctx;
        Ok(())
    }

    /// Runs after the function of `transition` has returned `WorkerError::Emergency`. With `Ok`,
    /// the component is unconfigured afterwards; with an error, which is what this default returns,
    /// it is finalized.
    fn error(
        &mut self,
        ctx: &mut C,
        transition: Transition,
        reason: &str,
    ) -> Result<(), WorkerError> {
        let _ = (ctx, transition);
        Err(WorkerError::Failed(reason.to_owned()))
    }

    /// As [`Worker::finalize`].
    fn finalize(&mut self, ctx: &mut C) {
        let _ = ctx;
    }
}
