//! Helpers of tests in addition to a bench: views of values, and configurations.

use crate::errors;
use crate::memory::Memory;
use crate::types::Types;
use crate::view::View;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rc_host::{Aligned, Program};
use rc_values::{Named, Struct, Type, encode_image};
use std::path::PathBuf;
use std::sync::Arc;

fn read(description: &str) -> PyResult<Program> {
    Program::read(description).map_err(pyo3::exceptions::PyValueError::new_err)
}

/// A view of a copy of this value, as a handler gets it that reads in place.
#[pyfunction]
pub(crate) fn view_of<'py>(
    py: Python<'py>,
    description: &str,
    types: &Bound<'py, PyDict>,
    value: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, View>> {
    let program = read(description)?;
    let types = Types::read(&program, types)?;
    let operations = program.slots.iter().flat_map(|slot| &slot.operations);
    let members = operations.flat_map(|o| o.request.members.iter().chain(&o.reply.members));
    let mut all = members.filter_map(|member| match &member.ty {
        Type::Named(Named::Struct(of)) if of.layout.is_some() => Some(of),
        _ => None,
    });
    let class = value.get_type();
    let is_of = |of: &&Arc<Struct>| {
        let known = types.class(&of.name);
        known.is_ok_and(|known| known.python.bind(py).is(&class))
    };
    let Some(ty) = all.find(is_of) else {
        let message = format!("{class} is not a type that this component has in place");
        return Err(PyTypeError::new_err(message));
    };
    let refused = |reason: String| errors::raise(py, "InvalidArgument", &reason);
    let value = types.structure(ty, value);
    let value = value.map_err(|misfit| refused(misfit.to_string()))?;
    let image = encode_image(&value).map_err(|error| refused(error.to_string()))?;
    let memory = Py::new(py, Memory::owned(Aligned::copied(&image)))?;
    let view = View::new(memory, Arc::clone(&types), Arc::clone(ty), 0);
    Bound::new(py, view)
}

/// The values of a configuration as the context gets them, and the period in nanoseconds that it
/// sets. Without a path it is the file in the folder of the component.
#[pyfunction]
pub(crate) fn configuration<'py>(
    py: Python<'py>,
    description: &str,
    folder: String,
    path: Option<PathBuf>,
) -> PyResult<(Bound<'py, PyDict>, Option<u64>)> {
    let program = read(description)?.in_folder(folder);
    let configured = rc_runtime::testing::configured_by(program.description, path);
    let configured = configured.map_err(|error| errors::raise(py, "Error", &error.to_string()))?;
    let values = crate::parameters::object(py, &configured.values)?;
    Ok((values, configured.period.map(crate::link::nanoseconds)))
}
