//! Why a network cannot be built or planned.

use std::io;

/// An error of this crate. Findings about the user's files are diagnostics instead.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The user's workspace or component does not allow a variant.
    #[error("{0}")]
    Workspace(String),
    /// The system refused something.
    #[error("cannot {action}: {source}")]
    System {
        /// What was tried, as in "cannot …".
        action: String,
        /// The reason.
        source: io::Error,
    },
}

/// Adds context to an error of the system: `.map_err(cannot("open the file"))`.
pub(crate) fn cannot<E: Into<io::Error>>(action: impl Into<String>) -> impl FnOnce(E) -> Error {
    let action = action.into();
    move |source| Error::System {
        action,
        source: source.into(),
    }
}
