//! The session of this thread, with exceptions of Python for its errors.

use crate::errors;
use pyo3::prelude::*;
use rc_host::{HostError, Number, Session, session};
use rc_runtime::machine::Machine;
use rc_runtime::{Core, TimeSource, WorkerError};

/// Passes the session of this thread to `use_it`. On another thread there is none.
pub(crate) fn with<T>(use_it: impl FnOnce(&mut Session) -> Result<T, HostError>) -> PyResult<T> {
    session::with(use_it).map_err(errors::of_host)
}

/// Passes the core, which is there while a function of the worker runs.
pub(crate) fn with_core<T>(use_it: impl FnOnce(&mut Core) -> T) -> PyResult<T> {
    session::with_core(use_it).map_err(errors::of_host)
}

/// Passes the state machine, which is there while a function of the worker runs.
pub(crate) fn with_machine<T>(
    use_it: impl FnOnce(&mut Machine<Number, Number>) -> T,
) -> PyResult<T> {
    session::with_machine(use_it).map_err(errors::of_host)
}

/// Passes the time of the network.
pub(crate) fn with_time<T>(use_it: impl FnOnce(&mut TimeSource) -> T) -> PyResult<T> {
    session::with_time(use_it).map_err(errors::of_host)
}

/// Logs the exception of a handler. A fatal one ends the component after the handler.
pub(crate) fn note_failure(py: Python<'_>, error: &PyErr) {
    if let WorkerError::Fatal(reason) = errors::of_worker(py, error)
        // The handler runs, so the core is there.
        && let Err(error) = with_core(|core| core.fail(&reason))
    {
        rc_runtime::tracing::error!("{reason}: {error}");
    }
}
