//! Ages as objects of the package `robocomp`.

use crate::types::Types;
use pyo3::prelude::*;
use rc_middleware::{Fresh, Freshness};
use rc_values::Value;

/// The module of the classes.
const MODULE: &str = "robocomp._freshness";

/// An age, and what the value is made of: `Freshness`.
pub(crate) fn age(py: Python<'_>, of: Freshness) -> PyResult<Bound<'_, PyAny>> {
    let make = py.import(MODULE)?.getattr("_freshness")?;
    make.call1((of.age, of.made.word(), of.is_fresh))
}

/// The values of a sample with their age: `Fresh` of the only one, or of a tuple.
pub(crate) fn object<'py>(
    py: Python<'py>,
    types: &Types,
    of: Fresh<Value>,
) -> PyResult<Bound<'py, PyAny>> {
    let values = match of.value {
        Value::Struct(_, values) => values,
        one => vec![one],
    };
    let parts = types.parts(py, values)?;
    let value = match parts.len() {
        1 => parts.get_item(0)?,
        _ => parts.into_any(),
    };
    let class = py.import(MODULE)?.getattr("Fresh")?;
    class.call1((value, age(py, of.freshness)?))
}
