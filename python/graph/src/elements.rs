//! Nodes and edges of a version.

use crate::values;
use property_graph::{EdgeId, EdgeRef, Id, NodeId, NodeRef, Snapshot};
use pyo3::exceptions::{PyKeyError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::collections::hash_map::DefaultHasher;
use std::hash::{Hash, Hasher as _};
use std::sync::Arc;

/// A node of a version.
#[pyclass(frozen, module = "robocomp._graph")]
pub(crate) struct Node {
    pub(crate) now: Arc<Snapshot>,
    pub(crate) id: NodeId,
}

/// An edge of a version.
#[pyclass(frozen, module = "robocomp._graph")]
pub(crate) struct Edge {
    pub(crate) now: Arc<Snapshot>,
    pub(crate) id: EdgeId,
}

fn id_text(id: Id) -> String {
    format!("{}:{}", id.writer(), id.count())
}

fn hash(now: &Snapshot, id: impl Hash) -> u64 {
    let mut hasher = DefaultHasher::new();
    (Arc::as_ptr(now.schema()), id).hash(&mut hasher);
    hasher.finish()
}

/// Whether two versions are of one graph. Each reading of a file makes a schema, which all versions of
/// its graph share.
fn are_of_one_graph(one: &Snapshot, other: &Snapshot) -> bool {
    Arc::ptr_eq(one.schema(), other.schema())
}

fn of_another_graph() -> PyErr {
    PyValueError::new_err("a node or an edge of another graph")
}

fn missing(name: &str) -> PyErr {
    PyKeyError::new_err(name.to_owned())
}

impl Node {
    fn here(&self) -> PyResult<NodeRef<'_>> {
        let node = self.now.node(self.id);
        node.map_err(|error| crate::refused(&error))
    }

    /// The node in another version of its graph.
    pub(crate) fn id_in(&self, now: &Snapshot) -> PyResult<NodeId> {
        if !are_of_one_graph(&self.now, now) {
            return Err(of_another_graph());
        }
        let here = now.node(self.id).map_err(|error| crate::refused(&error))?;
        Ok(here.node_id())
    }
}

impl Edge {
    fn here(&self) -> PyResult<EdgeRef<'_>> {
        let edge = self.now.edge(self.id);
        edge.map_err(|error| crate::refused(&error))
    }

    /// The edge in another version of its graph.
    pub(crate) fn id_in(&self, now: &Snapshot) -> PyResult<EdgeId> {
        if !are_of_one_graph(&self.now, now) {
            return Err(of_another_graph());
        }
        let here = now.edge(self.id).map_err(|error| crate::refused(&error))?;
        Ok(here.edge_id())
    }

    fn node(&self, id: NodeId) -> Node {
        Node {
            now: Arc::clone(&self.now),
            id,
        }
    }
}

#[pymethods]
impl Node {
    /// The id, `WRITER:COUNT`.
    #[getter]
    fn id(&self) -> PyResult<String> {
        Ok(id_text(self.here()?.id()))
    }

    /// The type.
    #[getter]
    fn r#type(&self) -> PyResult<&str> {
        Ok(self.here()?.type_name())
    }

    /// The attribute `name`, or an empty text.
    #[getter]
    fn name(&self) -> PyResult<&str> {
        Ok(self.here()?.name())
    }

    /// All attributes.
    fn attributes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        values::dictionary(py, self.here()?.attributes(), &self.now)
    }

    fn __getitem__<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let value = self.here()?.get(name).ok_or_else(|| missing(name))?;
        values::of_value(py, value, &self.now)
    }

    fn __contains__(&self, name: &str) -> PyResult<bool> {
        Ok(self.here()?.get(name).is_some())
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.id == other.id && are_of_one_graph(&self.now, &other.now)
    }

    fn __hash__(&self) -> u64 {
        hash(&self.now, self.id)
    }

    fn __repr__(&self) -> PyResult<String> {
        let here = self.here()?;
        Ok(format!("({}:{})", here.name(), here.type_name()))
    }
}

#[pymethods]
impl Edge {
    /// The id, `WRITER:COUNT`.
    #[getter]
    fn id(&self) -> PyResult<String> {
        Ok(id_text(self.here()?.id()))
    }

    /// The relation.
    #[getter]
    fn r#type(&self) -> PyResult<&str> {
        Ok(self.here()?.type_name())
    }

    /// The node where the edge starts.
    #[getter]
    fn start(&self) -> PyResult<Node> {
        Ok(self.node(self.here()?.from()))
    }

    /// The node where the edge ends.
    #[getter]
    fn end(&self) -> PyResult<Node> {
        Ok(self.node(self.here()?.to()))
    }

    /// All attributes.
    fn attributes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        values::dictionary(py, self.here()?.attributes(), &self.now)
    }

    fn __getitem__<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let value = self.here()?.get(name).ok_or_else(|| missing(name))?;
        values::of_value(py, value, &self.now)
    }

    fn __contains__(&self, name: &str) -> PyResult<bool> {
        Ok(self.here()?.get(name).is_some())
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.id == other.id && are_of_one_graph(&self.now, &other.now)
    }

    fn __hash__(&self) -> u64 {
        hash(&self.now, self.id)
    }

    fn __repr__(&self) -> PyResult<String> {
        Ok(format!("[:{}]", self.here()?.type_name()))
    }
}
