//! Values of parameters as objects of Python.

use pyo3::IntoPyObjectExt;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use rc_configuration::Field;
use rc_runtime::{ParamChange, Value, Values};
use std::time::Duration;

/// All values as a dict: groups are dicts, lists of structures are lists of dicts.
pub(crate) fn object<'py>(py: Python<'py>, values: &Values) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    for (name, field) in values.fields() {
        let object = match field {
            Field::Value(value) => value_object(py, value)?,
            Field::Group(values) => self::object(py, values)?.into_any(),
            Field::List(list) => {
                let items = list.iter().map(|values| self::object(py, values));
                let items = items.collect::<PyResult<Vec<_>>>()?;
                PyList::new(py, items)?.into_any()
            }
        };
        dict.set_item(name, object)?;
    }
    Ok(dict)
}

/// A value. A duration becomes a `timedelta`, which has whole microseconds.
pub(crate) fn value_object<'py>(py: Python<'py>, value: &Value) -> PyResult<Bound<'py, PyAny>> {
    match value {
        Value::Bool(value) => value.into_bound_py_any(py),
        Value::Int(value) => value.into_bound_py_any(py),
        Value::Float(value) => value.into_bound_py_any(py),
        Value::Text(value) => value.into_bound_py_any(py),
        Value::Duration(value) => Duration::from_nanos(*value).into_bound_py_any(py),
        Value::Array(items) => {
            let items = items.iter().map(|item| value_object(py, item));
            PyList::new(py, items.collect::<PyResult<Vec<_>>>()?)?.into_bound_py_any(py)
        }
    }
}

/// A value of a parameter: a `bool`, a number, a `timedelta`, a text, or a sequence of one of these.
///
/// # Errors
/// `TypeError` if it is none.
pub(crate) fn value(object: &Bound<'_, PyAny>) -> PyResult<Value> {
    if let Ok(value) = object.extract::<bool>() {
        return Ok(value.into());
    }
    if let Ok(value) = object.extract::<i64>() {
        return Ok(value.into());
    }
    if let Ok(value) = object.extract::<f64>() {
        return Ok(value.into());
    }
    if let Ok(value) = object.extract::<Duration>() {
        return Ok(value.into());
    }
    if let Ok(value) = object.extract::<String>() {
        return Ok(value.into());
    }
    let Ok(items) = object.try_iter() else {
        let ty = object.get_type().name()?;
        return Err(PyTypeError::new_err(format!(
            "no parameter has a value of the type {ty}"
        )));
    };
    let items = items.map(|item| value(&item?));
    Ok(Value::Array(items.collect::<PyResult<_>>()?))
}

/// Changes as a list of `robocomp.ParamChange`.
pub(crate) fn changes<'py>(
    py: Python<'py>,
    changes: &[ParamChange],
) -> PyResult<Bound<'py, PyList>> {
    let class = py.import("robocomp._worker")?.getattr("ParamChange")?;
    let changes = changes.iter().map(|change| {
        let (old, new) = (
            value_object(py, &change.old)?,
            value_object(py, &change.new)?,
        );
        class.call1((change.path.as_str(), old, new, change.secret))
    });
    PyList::new(py, changes.collect::<PyResult<Vec<_>>>()?)
}
