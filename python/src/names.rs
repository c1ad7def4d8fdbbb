//! Names of Python for names of the IDSL, where types are known at run time only.

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt};
use rc_vocabulary::{Class, Primitive};

/// The types of Python for numbers and `bool`, by the words of descriptions.
#[pyfunction]
pub(crate) fn primitives(py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
    let types = PyDict::new(py);
    for one in Primitive::ALL {
        let ty = match one.class() {
            Class::Bool => py.get_type::<PyBool>(),
            Class::Signed | Class::Unsigned => py.get_type::<PyInt>(),
            Class::Float => py.get_type::<PyFloat>(),
        };
        types.set_item(one.word(), ty)?;
    }
    Ok(types)
}

/// A name in the form of generated code. `kind` is the kind of the named object.
#[pyfunction]
pub(crate) fn name_of(kind: &str, name: &str) -> PyResult<String> {
    Ok(match kind {
        "enumerator" => rc_python_names::shout(name),
        "exception member" => rc_python_names::exception_member(name),
        "function" => rc_python_names::snake(name),
        "member" => rc_python_names::member(name),
        "method" => rc_python_names::method(name),
        "parameter" => rc_python_names::parameter(name),
        "part" => rc_python_names::tuple_member(name),
        _ => return Err(PyValueError::new_err(format!("nothing is a `{kind}`"))),
    })
}

/// The name among these that is most like a misspelled one.
#[pyfunction]
#[expect(clippy::needless_pass_by_value, reason = "an argument of Python")]
pub(crate) fn nearest(name: &str, names: Vec<String>) -> Option<String> {
    let names = names.iter().map(String::as_str);
    rc_diagnostics::nearest(name, names).map(str::to_owned)
}
