//! Waits for other threads that Ctrl-C ends.

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::time::Duration;

/// How often a wait checks for Ctrl-C.
const LOOK: Duration = Duration::from_millis(100);

/// Runs a slow function on a thread of its own, and waits for it without the interpreter's lock.
/// Ctrl-C ends the wait; the thread ends at the limit of the function.
pub(crate) fn interruptible<T: Send + 'static>(
    py: Python<'_>,
    act: impl FnOnce() -> T + Send + 'static,
) -> PyResult<T> {
    let (done, results) = sync_channel(1);
    let thread = std::thread::Builder::new().name("client".to_owned());
    thread.spawn(move || {
        // The waiting thread may have stopped waiting.
        let _ = done.send(act());
    })?;
    let ended = awaited(py, results)?;
    ended.ok_or_else(|| PyRuntimeError::new_err("the thread of the client panicked"))
}

/// Waits for a result of another thread, without the interpreter's lock. Ctrl-C ends the wait.
/// `None` if the thread has ended without one.
pub(crate) fn awaited<T: Send>(py: Python<'_>, mut results: Receiver<T>) -> PyResult<Option<T>> {
    loop {
        let result;
        (results, result) = py.detach(move || {
            let result = results.recv_timeout(LOOK);
            (results, result)
        });
        match result {
            Ok(result) => return Ok(Some(result)),
            Err(RecvTimeoutError::Timeout) => py.check_signals()?,
            Err(RecvTimeoutError::Disconnected) => return Ok(None),
        }
    }
}
