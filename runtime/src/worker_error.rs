//! The ways in which a worker fails.

/// Why a worker could not do its work.
///
/// Every error converts into `Failed`, with its sources, so `?` reports a failed run of
/// `compute()`:
///
/// ```
/// use rc_runtime::WorkerError;
///
/// fn compute() -> Result<(), WorkerError> {
///     let _ = std::fs::read("/nowhere")?;
///     Ok(())
/// }
///
/// assert!(matches!(compute(), Err(WorkerError::Failed(_))));
/// ```
#[derive(Debug)]
pub enum WorkerError {
    /// The runtime logs and counts the failure; the component runs on. A transition of the life
    /// cycle fails: the component returns to its previous state.
    Failed(String),
    /// The component enters the state Emergency, in which `emergency()` runs in place of
    /// `compute()`. After a function of the life cycle, its error processing follows instead.
    Emergency(String),
    /// The component ends with exit code 3.
    Fatal(String),
}

impl<E: std::error::Error> From<E> for WorkerError {
    fn from(error: E) -> Self {
        let mut message = error.to_string();
        let mut source = error.source();
        while let Some(inner) = source {
            message = format!("{message}: {inner}");
            source = inner.source();
        }
        Self::Failed(message)
    }
}

impl std::fmt::Display for WorkerError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (Self::Failed(reason) | Self::Emergency(reason) | Self::Fatal(reason)) = self;
        f.write_str(reason)
    }
}
