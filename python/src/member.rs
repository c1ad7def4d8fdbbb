//! The class `Member`: a member of a slot array, which the worker opened.

use pyo3::prelude::*;

/// A member of a slot array. It is a key of a dict.
#[pyclass(frozen, eq, hash, module = "robocomp._native")]
#[derive(PartialEq, Eq, Hash)]
pub(crate) struct Member(pub(crate) rc_runtime::Member);

#[pymethods]
impl Member {
    /// Number in the array, in the order in which the worker opened the members, from 0.
    #[getter]
    fn index(&self) -> usize {
        self.0.index()
    }

    /// Name, as the worker opened it.
    #[getter]
    fn name(&self) -> &str {
        self.0.name()
    }

    fn __repr__(&self) -> String {
        format!("<member {} `{}`>", self.0.index(), self.0.name())
    }
}
