//! Values of parameters as objects of Python.

use crate::from_python::shown;
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

/// A value of a parameter: a `bool`, a number, a text, a `timedelta` that is not negative, or a sequence of these.
///
/// # Errors
/// `TypeError` if it is none.
pub(crate) fn value(object: &Bound<'_, PyAny>) -> PyResult<Value> {
    if let Some(value) = one(object) {
        return Ok(value);
    }
    // A sequence in a sequence is refused: it may be in itself.
    let other = |object: &Bound<'_, PyAny>| {
        PyTypeError::new_err(format!(
            "no parameter has the value {}: expected a bool, a number, a text, a timedelta that is not negative, \
            or a sequence of these",
            shown(object)
        ))
    };
    let Ok(items) = object.try_iter() else {
        return Err(other(object));
    };
    let items = items.map(|item| {
        let item = item?;
        one(&item).ok_or_else(|| other(&item))
    });
    Ok(Value::Array(items.collect::<PyResult<_>>()?))
}

/// A value that is no sequence.
fn one(object: &Bound<'_, PyAny>) -> Option<Value> {
    let value = if let Ok(value) = object.extract::<bool>() {
        value.into()
    } else if let Ok(value) = object.extract::<i64>() {
        value.into()
    } else if let Ok(value) = object.extract::<f64>() {
        value.into()
    } else if let Ok(value) = object.extract::<Duration>() {
        value.into()
    } else {
        object.extract::<String>().ok()?.into()
    };
    Some(value)
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
