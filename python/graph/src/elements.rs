//! Nodes and edges of a version.

use property_graph::{EdgeId, EdgeRef, Id, NodeId, NodeRef, Snapshot};
use pyo3::exceptions::{PyKeyError, PyValueError};
use pyo3::prelude::*;
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

pub(crate) fn id_text(id: Id) -> String {
    format!("{}:{}", id.writer(), id.count())
}

pub(crate) fn hash(now: &Snapshot, id: impl Hash) -> u64 {
    let mut hasher = DefaultHasher::new();
    (Arc::as_ptr(now.schema()), id).hash(&mut hasher);
    hasher.finish()
}

/// Whether two versions are of one graph. Each reading of a file makes a schema, which all versions of
/// its graph share.
pub(crate) fn are_of_one_graph(one: &Snapshot, other: &Snapshot) -> bool {
    Arc::ptr_eq(one.schema(), other.schema())
}

fn of_another_graph() -> PyErr {
    PyValueError::new_err("a node or an edge of another graph")
}

pub(crate) fn missing(name: &str) -> PyErr {
    PyKeyError::new_err(name.to_owned())
}

impl Node {
    pub(crate) fn here(&self) -> PyResult<NodeRef<'_>> {
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
    pub(crate) fn here(&self) -> PyResult<EdgeRef<'_>> {
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

    pub(crate) fn node(&self, id: NodeId) -> Node {
        Node {
            now: Arc::clone(&self.now),
            id,
        }
    }
}
