//! Names of Python for names of the IDSL, in clients whose types are known at run time only.

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// A name as generated code has it. `kind` says what is named.
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
