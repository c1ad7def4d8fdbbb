//! Values, between Python and a graph.

use crate::elements::{Edge, Node};
use graph_query::Cell;
use property_graph::{Snapshot, Value};
use pyo3::exceptions::{PyOverflowError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{
    PyBool, PyBytes, PyDict, PyFloat, PyInt, PyList, PyListMethods, PyString, PyTuple,
};
use std::sync::Arc;

/// A value of a graph in Python, as queries have it.
pub(crate) fn of_value<'py>(
    py: Python<'py>,
    value: &Value,
    now: &Arc<Snapshot>,
) -> PyResult<Bound<'py, PyAny>> {
    of_cell(py, &Cell::from(value), now)
}

pub(crate) fn dictionary<'py, 'a>(
    py: Python<'py>,
    all: impl Iterator<Item = (&'a str, &'a Value)>,
    now: &Arc<Snapshot>,
) -> PyResult<Bound<'py, PyDict>> {
    let made = PyDict::new(py);
    for (name, value) in all {
        made.set_item(name, of_value(py, value, now)?)?;
    }
    Ok(made)
}

/// A value of a query in Python.
pub(crate) fn of_cell<'py>(
    py: Python<'py>,
    cell: &Cell,
    now: &Arc<Snapshot>,
) -> PyResult<Bound<'py, PyAny>> {
    Ok(match cell {
        Cell::Null => py.None().into_bound(py),
        Cell::Bool(yes) => PyBool::new(py, *yes).to_owned().into_any(),
        Cell::Int(number) => PyInt::new(py, *number).into_any(),
        Cell::Float(number) => PyFloat::new(py, *number).into_any(),
        Cell::Text(text) => PyString::new(py, text).into_any(),
        Cell::Bytes(bytes) => PyBytes::new(py, bytes).into_any(),
        Cell::List(all) => {
            let all = all.iter().map(|cell| of_cell(py, cell, now));
            PyList::new(py, all.collect::<PyResult<Vec<_>>>()?)?.into_any()
        }
        Cell::Node(id) => {
            let node = Node {
                now: Arc::clone(now),
                id: *id,
            };
            Bound::new(py, node)?.into_any()
        }
        Cell::Edge(id) => {
            let edge = Edge {
                now: Arc::clone(now),
                id: *id,
            };
            Bound::new(py, edge)?.into_any()
        }
    })
}

/// How deeply lists of parameters are nested at most.
const DEEPEST: usize = 16;

/// How many values the lists of a parameter have at most, together.
const MOST_VALUES: usize = 1 << 16;

/// A value of Python for a query. A node of another version is the same node in this version.
pub(crate) fn cell(value: &Bound<'_, PyAny>, now: &Snapshot) -> PyResult<Cell> {
    let mut left = MOST_VALUES;
    nested(value, now, DEEPEST, &mut left)
}

fn nested(
    value: &Bound<'_, PyAny>,
    now: &Snapshot,
    deepest: usize,
    left: &mut usize,
) -> PyResult<Cell> {
    if value.is_none() {
        return Ok(Cell::Null);
    }
    if let Ok(yes) = value.cast::<PyBool>() {
        return Ok(Cell::Bool(yes.is_true()));
    }
    if value.is_instance_of::<PyInt>() {
        let number = value.extract();
        return number
            .map(Cell::Int)
            .map_err(|_| PyValueError::new_err("an integer of a graph has 64 bits at most"));
    }
    if value.is_instance_of::<PyFloat>() {
        return Ok(Cell::Float(value.extract()?));
    }
    if let Ok(text) = value.cast::<PyString>() {
        return Ok(Cell::Text(text.to_cow()?.into()));
    }
    if let Ok(bytes) = value.cast::<PyBytes>() {
        return Ok(Cell::Bytes(bytes.as_bytes().into()));
    }
    if let Ok(node) = value.cast::<Node>() {
        return Ok(Cell::Node(node.get().id_in(now)?));
    }
    if let Ok(edge) = value.cast::<Edge>() {
        return Ok(Cell::Edge(edge.get().id_in(now)?));
    }
    let list = value.cast::<PyList>().map(PyListMethods::to_tuple);
    if let Ok(all) = list.or_else(|_| value.cast::<PyTuple>().cloned()) {
        let deeper = deepest.checked_sub(1).ok_or_else(|| {
            PyValueError::new_err(format!("lists are nested {DEEPEST} deep at most"))
        })?;
        *left = left.checked_sub(all.len()).ok_or_else(|| {
            PyValueError::new_err(format!("lists have {MOST_VALUES} values at most"))
        })?;
        let cells = all.iter().map(|item| nested(&item, now, deeper, left));
        let cells: PyResult<Vec<Cell>> = cells.collect();
        return Ok(Cell::List(cells?.into()));
    }
    let kind = value.get_type().name()?;
    Err(PyTypeError::new_err(format!(
        "expected a truth value, a number, a text, bytes, a node, an edge, a list or a tuple, found {kind}"
    )))
}

/// A budget, of steps or of rows.
pub(crate) fn budget(value: &Bound<'_, PyAny>) -> PyResult<u64> {
    value.extract().map_err(|error: PyErr| {
        if error.is_instance_of::<PyOverflowError>(value.py()) {
            let most = u64::MAX;
            PyValueError::new_err(format!("a budget is from 0 to {most}, found {value}"))
        } else {
            error
        }
    })
}
