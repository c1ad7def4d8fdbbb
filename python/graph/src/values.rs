//! Values, between Python and a graph.

use crate::elements::{Edge, Node};
use graph_query::Cell;
use property_graph::{Snapshot, Value};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyBytes, PyDict, PyFloat, PyInt, PyList, PyString};
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

/// A value of Python for a query. A node of another version is the one with its id.
pub(crate) fn cell(value: &Bound<'_, PyAny>, now: &Snapshot) -> PyResult<Cell> {
    nested(value, now, DEEPEST)
}

fn nested(value: &Bound<'_, PyAny>, now: &Snapshot, left: usize) -> PyResult<Cell> {
    if value.is_none() {
        return Ok(Cell::Null);
    }
    if let Ok(yes) = value.cast::<PyBool>() {
        return Ok(Cell::Bool(yes.is_true()));
    }
    if value.is_instance_of::<PyInt>() {
        return Ok(Cell::Int(value.extract()?));
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
        let node = node.get();
        let id = node.now.node(node.id).map(|node| node.id());
        let here = id.ok().and_then(|id| now.find_node(id));
        return here.map(Cell::Node).ok_or_else(removed);
    }
    if let Ok(edge) = value.cast::<Edge>() {
        let edge = edge.get();
        let id = edge.now.edge(edge.id).map(|edge| edge.id());
        let here = id.ok().and_then(|id| now.find_edge(id));
        return here.map(Cell::Edge).ok_or_else(removed);
    }
    if left > 0
        && let Ok(items) = value.try_iter()
    {
        let cells = items.map(|item| nested(&item?, now, left - 1));
        let cells: PyResult<Vec<Cell>> = cells.collect();
        return Ok(Cell::List(cells?.into()));
    }
    let kind = value.get_type().name()?;
    Err(PyTypeError::new_err(format!(
        "expected a truth value, a number, a text, bytes, a node, an edge or a list, found {kind}"
    )))
}

fn removed() -> PyErr {
    PyValueError::new_err("the version has no such element")
}
