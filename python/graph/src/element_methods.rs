//! The methods that nodes and edges of a version have in Python.

use crate::elements::{Edge, Node, are_of_one_graph, hash, id_text, missing};
use crate::values;
use pyo3::prelude::*;
use pyo3::types::PyDict;

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
