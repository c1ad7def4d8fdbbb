//! The errors of the runtime as exceptions of the package `robocomp`, and the other way.

use pyo3::prelude::*;
use pyo3::types::PyTuple;
use rc_host::HostError;
use rc_middleware::{CallError, SendError};
use rc_runtime::{MemberError, StartError, TimeError, WorkerError};
use std::collections::VecDeque;
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
pub(crate) fn no_such(what: &'static str, slot: usize) -> PyErr {
    of_host(HostError::NoSuch { what, slot })
}

/// The exception for a context that did nothing.
#[expect(clippy::needless_pass_by_value, reason = "a function for `map_err`")]
pub(crate) fn of_host(error: HostError) -> PyErr {
    match &error {
        HostError::WrongThread => wrong_thread(),
        HostError::Member(error) => of_member(error),
        _ => pyo3::exceptions::PyIndexError::new_err(error.to_string()),
    }
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
        CallError::NoValue => "NoValue",
        CallError::Stale { .. } => "Stale",
        CallError::Invalid(_) => "InvalidArgument",
        CallError::Malformed(_) => "MalformedReply",
        _ => "MiddlewareError",
    };
    let raised = raise(py, name, &error.to_string());
    if let CallError::Unavailable { state } = error {
        // Without the attribute, the message still has the state.
        let _ = raised.value(py).setattr("state", state);
    }
    if let CallError::Stale { age } = error {
        // Without the attribute, the message still has the age.
        let _ = raised.value(py).setattr("age", *age);
    }
    raised
}

/// The exception for a component that does not start.
pub(crate) fn of_start(error: &StartError) -> PyErr {
    Python::attach(|py| raise(py, "StartError", error.to_string().trim_end()))
}

/// The exception for a member that was not opened.
pub(crate) fn of_member(error: &MemberError) -> PyErr {
    Python::attach(|py| raise(py, "MemberError", &error.to_string()))
}

/// The exception for time that did not advance.
pub(crate) fn of_time(error: &TimeError) -> PyErr {
    Python::attach(|py| {
        let raised = raise(py, "TimeError", &error.to_string());
        if let TimeError::Waiting { tick, waiting_for } = error {
            let value = raised.value(py);
            let followers = PyTuple::new(py, waiting_for);
            // Without the attributes, the message still has both.
            let _ = value.setattr("tick", tick);
            let _ = followers.and_then(|followers| value.setattr("waiting_for", followers));
        }
        raised
    })
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

/// Where tracebacks began that were logged, the last ones at the end, and when.
static LOGGED: Mutex<VecDeque<(String, Instant)>> = Mutex::new(VecDeque::new());

/// The least time between two tracebacks of one place.
const PAUSE: Duration = Duration::from_secs(5);
/// The number of places that are known.
const PLACES: usize = 32;

/// Logs the traceback of an exception, that of one type from one place once in five seconds,
/// whatever its message is.
pub(crate) fn log_traceback(py: Python<'_>, error: &PyErr) {
    let origin = origin(py, error);
    if let Ok(mut logged) = LOGGED.lock()
        && is_again(&mut logged, origin, Instant::now())
    {
        return;
    }
    if let Some(text) = traceback(py, error) {
        // The log may be a pipe that is full.
        py.detach(|| rc_runtime::tracing::error!("{}", text.trim_end()));
    }
}

/// Whether a traceback of this place was logged a moment ago. If not, notes it.
fn is_again(logged: &mut VecDeque<(String, Instant)>, origin: String, now: Instant) -> bool {
    logged.retain(|(_, at)| now.saturating_duration_since(*at) < PAUSE);
    if logged.iter().any(|(known, _)| *known == origin) {
        return true;
    }
    if logged.len() == PLACES {
        logged.pop_front();
    }
    logged.push_back((origin, now));
    false
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_traceback_of_each_place_is_logged_once_in_a_while() {
        let (mut logged, now) = (VecDeque::new(), Instant::now());
        let mut is_again = |place: usize, at| is_again(&mut logged, place.to_string(), at);
        // Two places that fail in turn.
        assert_eq!(
            [1, 2, 1, 2].map(|place| is_again(place, now)),
            [false, false, true, true]
        );
        assert!(!is_again(1, now + PAUSE));
        // Many places: the oldest one is forgotten.
        assert!((10..10 + PLACES).all(|place| !is_again(place, now + PAUSE)));
        assert!(is_again(11, now + PAUSE));
        assert!(!is_again(1, now + PAUSE));
    }
}
