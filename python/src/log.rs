//! Lines of Python's `logging` in the log of the component.

use pyo3::prelude::*;
use rc_runtime::tracing;

/// Logs a line. Levels are those of `logging`.
#[pyfunction]
pub(crate) fn log(py: Python<'_>, level: u32, text: &str) {
    // The log may be a pipe that is full.
    py.detach(|| match level {
        40.. => tracing::error!("{text}"),
        30.. => tracing::warn!("{text}"),
        20.. => tracing::info!("{text}"),
        10.. => tracing::debug!("{text}"),
        _ => tracing::trace!("{text}"),
    });
}
