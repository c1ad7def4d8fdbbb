//! The errors of the runtime as exceptions of the package `robocomp`, and the other way.

use pyo3::prelude::*;
use rc_middleware::{CallError, SendError};
use rc_runtime::WorkerError;
use std::sync::Mutex;
use std::time::{Duration, Instant};

/// The module of the exceptions.
const MODULE: &str = "robocomp._errors";

/// An exception of the package `robocomp`.
pub(crate) fn raise(py: Python<'_>, name: &str, message: &str) -> PyErr {
    let class = py.import(MODULE).and_then(|module| module.getattr(name));
    match class.and_then(|class| class.call1((message,))) {
        Ok(error) => PyErr::from_value(error),
        Err(error) => error,
    }
}

/// The context was used where it is not.
pub(crate) fn wrong_thread() -> PyErr {
    Python::attach(|py| {
        raise(
            py,
            "WrongThread",
            "ctx works on the thread of the worker only, while one of its functions runs; let other \
             threads put their results into a queue.SimpleQueue, and use ctx where compute() takes \
             them out",
        )
    })
}

/// The generated package does not fit its description.
pub(crate) fn no_such(what: &str, slot: usize) -> PyErr {
    pyo3::exceptions::PyIndexError::new_err(format!(
        "slot {slot} has no such {what}; generate the component anew"
    ))
}

/// The exception for a call that failed.
pub(crate) fn of_call(py: Python<'_>, error: &CallError) -> PyErr {
    let name = match error {
        CallError::NoServer(_) => "NoServer",
        CallError::Deadline { .. } => "Deadline",
        CallError::ServerDied(_) => "ServerDied",
        CallError::QueueFull(_) => "QueueFull",
        CallError::Refused(_) => "Refused",
        CallError::Unavailable { .. } => "Unavailable",
        CallError::Stopping => "Stopping",
        CallError::Invalid(_) => "InvalidArgument",
        CallError::Malformed(_) => "MalformedReply",
        _ => "MiddlewareError",
    };
    let raised = raise(py, name, &error.to_string());
    if let CallError::Unavailable { state } = error {
        // Without the attribute, the message still has the state.
        let _ = raised.value(py).setattr("state", state);
    }
    raised
}

/// The exception for a sample that was not sent.
pub(crate) fn of_sending(py: Python<'_>, error: &SendError) -> PyErr {
    let name = match error {
        SendError::Invalid(_) => "InvalidSample",
        _ => "NotSent",
    };
    raise(py, name, &error.to_string())
}

/// An exception of a function of the worker as the runtime's error. The log gets the traceback of
/// one that the worker did not raise as a `WorkerError`.
pub(crate) fn of_worker(py: Python<'_>, error: &PyErr) -> WorkerError {
    let message = error.value(py).to_string();
    for (name, kind) in [
        (
            "Emergency",
            WorkerError::Emergency as fn(String) -> WorkerError,
        ),
        ("Fatal", WorkerError::Fatal),
        ("WorkerError", WorkerError::Failed),
    ] {
        let class = py.import(MODULE).and_then(|module| module.getattr(name));
        if class.is_ok_and(|class| error.value(py).is_instance(&class).unwrap_or(false)) {
            return kind(message);
        }
    }
    let text = one_line(py, error);
    log_traceback(py, error);
    if error.is_instance_of::<pyo3::exceptions::PySystemExit>(py) {
        return WorkerError::Fatal(format!("the worker ended the process: {text}"));
    }
    WorkerError::Failed(text)
}

/// The type of an exception and its message, as in `ValueError: too far`.
pub(crate) fn one_line(py: Python<'_>, error: &PyErr) -> String {
    let name = error.get_type(py).name();
    let name = name.map(|name| name.to_string()).unwrap_or_default();
    let message = error.value(py).to_string();
    if message.is_empty() {
        name
    } else {
        format!("{name}: {message}")
    }
}

/// Where the traceback began that was logged last, and when.
static LOGGED: Mutex<Option<(String, Instant)>> = Mutex::new(None);

/// The least time between two tracebacks of one place.
const PAUSE: Duration = Duration::from_secs(5);

/// Logs the traceback of an exception, that of one type from one place once in five seconds,
/// whatever its message is.
pub(crate) fn log_traceback(py: Python<'_>, error: &PyErr) {
    let origin = origin(py, error);
    if let Ok(mut logged) = LOGGED.lock() {
        let again = logged
            .as_ref()
            .is_some_and(|(last, at)| *last == origin && at.elapsed() < PAUSE);
        if again {
            return;
        }
        *logged = Some((origin, Instant::now()));
    }
    if let Some(text) = traceback(py, error) {
        rc_runtime::tracing::error!("{}", text.trim_end());
    }
}

/// The type of an exception, and the code and line that raised it.
fn origin(py: Python<'_>, error: &PyErr) -> String {
    let name = error.get_type(py).name();
    let mut origin = name.map(|name| name.to_string()).unwrap_or_default();
    let mut frame = error.traceback(py).map(pyo3::Bound::into_any);
    while let Some(here) = frame.filter(|frame| !frame.is_none()) {
        let line = here.getattr("tb_lineno").map(|line| line.to_string());
        let code = here.getattr("tb_frame").and_then(|f| f.getattr("f_code"));
        let code = code.and_then(|code| code.getattr("co_qualname"));
        let code = code.map(|code| code.to_string());
        origin.push_str(&format!(
            " {} {}",
            code.unwrap_or_default(),
            line.unwrap_or_default()
        ));
        frame = here.getattr("tb_next").ok();
    }
    origin
}

/// The exception as Python prints it.
pub(crate) fn traceback(py: Python<'_>, error: &PyErr) -> Option<String> {
    let module = py.import("traceback").ok()?;
    let arguments = (error.get_type(py), error.value(py), error.traceback(py));
    let lines = module.call_method1("format_exception", arguments).ok()?;
    let lines: Vec<String> = lines.extract().ok()?;
    Some(lines.concat())
}
