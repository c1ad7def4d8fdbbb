//! The user's worker: its functions by their names.

use pyo3::call::PyCallArgs;
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use rc_host::{Machine, Program};
use rc_runtime::Role;
use std::collections::HashMap;

/// The mark of a function that the generated class has and the worker did not write.
const DEFAULT: &str = "_robocomp_default";

/// The functions of `Worker` that a worker may write.
const HOOKS: [&str; 12] = [
    "initialize",
    "compute",
    "params_changed",
    "emergency",
    "restore",
    "finalize",
    "configure",
    "activate",
    "deactivate",
    "cleanup",
    "shutdown",
    "error",
];

/// The functions of a worker, bound to it.
pub(crate) struct Worker {
    object: Py<PyAny>,
    functions: HashMap<String, Py<PyAny>>,
}

impl Worker {
    /// Finds all functions that the component may call.
    pub(crate) fn new(program: &Program, worker: &Bound<'_, PyAny>) -> PyResult<Self> {
        let mut names: Vec<String> = HOOKS.iter().map(|&name| name.to_owned()).collect();
        for slot in &program.slots {
            if matches!(slot.role, Role::Implements | Role::SubscribesTo) {
                names.extend(slot.operations.iter().map(|o| o.handler.clone()));
            }
        }
        names.extend(program.collected.iter().cloned());
        if let Some(machine) = program.machine {
            names.extend(machine_names(machine));
        }
        let mut functions = HashMap::new();
        for name in names {
            let Some(function) = worker.getattr_opt(name.as_str())? else {
                continue;
            };
            if !function.hasattr(DEFAULT)? {
                functions.insert(name, function.unbind());
            }
        }
        Ok(Self {
            object: worker.clone().unbind(),
            functions,
        })
    }

    /// The user's object.
    pub(crate) fn object<'py>(&self, py: Python<'py>) -> &Bound<'py, PyAny> {
        self.object.bind(py)
    }

    /// Whether the worker wrote the function.
    pub(crate) fn has(&self, name: &str) -> bool {
        self.functions.contains_key(name)
    }

    /// Calls a function, if the worker wrote it.
    pub(crate) fn call<'py>(
        &self,
        py: Python<'py>,
        name: &str,
        arguments: impl PyCallArgs<'py>,
    ) -> PyResult<Py<PyAny>> {
        match self.functions.get(name) {
            Some(function) => function.call1(py, arguments),
            None => Ok(py.None()),
        }
    }

    /// Calls a handler. The start has checked that there is one.
    pub(crate) fn handle(
        &self,
        py: Python<'_>,
        name: &str,
        arguments: Bound<'_, PyTuple>,
    ) -> PyResult<Py<PyAny>> {
        match self.functions.get(name) {
            Some(function) => function.call1(py, arguments),
            None => Err(pyo3::exceptions::PyNotImplementedError::new_err(format!(
                "the worker has no function {name}()"
            ))),
        }
    }
}

fn machine_names(machine: &Machine) -> Vec<String> {
    let mut names = Vec::new();
    for state in machine.states.iter().filter(|state| !state.is_empty()) {
        names.extend(["entry", "exit", "during"].map(|prefix| format!("{prefix}_{state}")));
    }
    names.extend(machine.guards.iter().cloned());
    names.extend(machine.actions.iter().cloned());
    names
}
