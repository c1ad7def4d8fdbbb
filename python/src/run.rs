//! Runs a component, in this process or on a thread of it.

use crate::alive::{Alive, LOOK};
use crate::component::Start;
use crate::errors;
use crate::types::Types;
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rc_host::Program;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

/// Reads the description from the generated package.
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

/// Runs a component with these arguments of its command line, until it ends. `launcher` is the
/// script that starts this process, or empty. Returns the exit code.
#[pyfunction]
#[pyo3(signature = (description, types, context, worker, folder, args, launcher))]
#[expect(
    clippy::too_many_arguments,
    reason = "the generated package hands over so much"
)]
pub(crate) fn run(
    py: Python<'_>,
    description: &str,
    types: &Bound<'_, PyDict>,
    context: Bound<'_, PyAny>,
    worker: Bound<'_, PyAny>,
    folder: String,
    args: Vec<String>,
    launcher: PathBuf,
) -> PyResult<u8> {
    let start = read(description, types, context, worker, folder)?;
    let description = start.program.description;
    let args = args.into_iter().map(Into::into);
    Ok(py.detach(|| {
        rc_runtime::run_with(
            description,
            |core, ports, values| start.start(core, ports, values),
            args,
            launcher,
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
#[expect(
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
    let component = embedded.map_err(|error| errors::of_start(&error))?;
    Ok(Embedded {
        component: Mutex::new(Some(component)),
    })
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
