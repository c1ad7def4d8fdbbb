//! Runs a component, in this process or on a thread of it.

use crate::component::Start;
use crate::description::Program;
use crate::errors;
use crate::types::Types;
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// How long components may take to end.
const ENDING: Duration = Duration::from_secs(5);
/// The pause between two looks.
const LOOK: Duration = Duration::from_millis(1);

/// The number of components that may run Python code, on threads of this process.
static ALIVE: AtomicUsize = AtomicUsize::new(0);

/// Counts a component in [`ALIVE`], from its start until its thread drops it.
pub(crate) struct Alive(());

impl Alive {
    fn new() -> Self {
        ALIVE.fetch_add(1, Ordering::AcqRel);
        Self(())
    }
}

impl Drop for Alive {
    fn drop(&mut self) {
        ALIVE.fetch_sub(1, Ordering::AcqRel);
    }
}

/// Waits for a while until all components have ended, those that did not start in time included:
/// before the interpreter ends, as no thread may run Python code then. Returns whether they have.
#[pyfunction]
pub(crate) fn await_end(py: Python<'_>) -> bool {
    let end = Instant::now() + ENDING;
    py.detach(|| {
        while ALIVE.load(Ordering::Acquire) > 0 {
            if Instant::now() >= end {
                return false;
            }
            std::thread::sleep(LOOK);
        }
        true
    })
}

/// Reads what the generated package hands over.
fn read(
    description: &str,
    types: &Bound<'_, PyDict>,
    context: Bound<'_, PyAny>,
    worker: Bound<'_, PyAny>,
    folder: String,
) -> PyResult<Start> {
    let program = Program::read(description).map_err(PyValueError::new_err)?;
    let program = Arc::new(program.in_folder(folder));
    let types = Types::read(&program, types)?;
    Ok(Start {
        program,
        types,
        context: context.unbind(),
        worker: worker.unbind(),
        alive: Alive::new(),
    })
}

/// Runs a component with these arguments of its command line, until it ends. Returns the exit code.
#[pyfunction]
#[pyo3(signature = (description, types, context, worker, folder, args))]
pub(crate) fn run(
    py: Python<'_>,
    description: &str,
    types: &Bound<'_, PyDict>,
    context: Bound<'_, PyAny>,
    worker: Bound<'_, PyAny>,
    folder: String,
    args: Vec<String>,
) -> PyResult<u8> {
    let start = read(description, types, context, worker, folder)?;
    let description = start.program.description;
    let args = args.into_iter().map(Into::into);
    Ok(py.detach(|| {
        rc_runtime::run_with(
            description,
            |core, ports, values| start.start(core, ports, values),
            args,
        )
    }))
}

/// A component that runs on a thread of this process, for tests.
#[pyclass(frozen, module = "robocomp._native")]
pub(crate) struct Embedded {
    component: Mutex<Option<rc_runtime::Embedded>>,
}

/// Runs a component on a thread of this process. Returns when it runs.
#[pyfunction]
#[allow(
    clippy::needless_pass_by_value,
    reason = "a function of Python owns its arguments"
)]
pub(crate) fn embed(
    py: Python<'_>,
    description: &str,
    types: &Bound<'_, PyDict>,
    context: Bound<'_, PyAny>,
    worker: Bound<'_, PyAny>,
    folder: String,
    args: Vec<String>,
) -> PyResult<Embedded> {
    let start = read(description, types, context, worker, folder)?;
    let description = start.program.description;
    let embedded = py.detach(|| {
        let args: Vec<&str> = args.iter().map(String::as_str).collect();
        let start = move |core, ports: &_, values: &_| start.start(core, ports, values);
        rc_runtime::embed(description, start, &args)
    });
    let component = embedded.map_err(|error| not_started(&error.to_string()))?;
    Ok(Embedded {
        component: Mutex::new(Some(component)),
    })
}

fn not_started(reason: &str) -> PyErr {
    Python::attach(|py| errors::raise(py, "StartError", reason))
}

#[pymethods]
impl Embedded {
    /// Requests the end of the component.
    fn stop(&self) {
        if let Some(component) = &*self.lock() {
            component.stop();
        }
    }

    /// Whether the component has ended.
    fn has_ended(&self) -> bool {
        self.lock()
            .as_ref()
            .is_none_or(rc_runtime::Embedded::has_ended)
    }

    /// Waits until the component ends, after `stop` or by itself. Ctrl-C ends the wait. Meanwhile
    /// other threads may stop the component.
    fn join(&self, py: Python<'_>) -> PyResult<()> {
        while !self.has_ended() {
            py.check_signals()?;
            py.detach(|| std::thread::sleep(LOOK));
        }
        let Some(component) = self.lock().take() else {
            return Ok(());
        };
        let ended = py.detach(|| component.join());
        ended.map_err(|error| PyRuntimeError::new_err(error.to_string()))
    }
}

impl Embedded {
    fn lock(&self) -> std::sync::MutexGuard<'_, Option<rc_runtime::Embedded>> {
        self.component
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
    }
}
