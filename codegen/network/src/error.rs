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
        /// Failed action, a verb phrase after "cannot".
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

/// As [`cannot`], for reading or writing a workspace: invalid input is an error of its files, not
/// of the system.
pub(crate) fn refused(action: impl Into<String>) -> impl FnOnce(io::Error) -> Error {
    let action = action.into();
    move |source| match source.kind() {
        io::ErrorKind::InvalidInput => Error::Workspace(format!("cannot {action}: {source}")),
        _ => Error::System { action, source },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_invalid_input_counts_as_a_user_error() {
        let error = |kind: io::ErrorKind| refused("add")(kind.into());
        let invalid = error(io::ErrorKind::InvalidInput);
        assert!(matches!(invalid, Error::Workspace(_)), "{invalid}");
        for kind in [io::ErrorKind::StorageFull, io::ErrorKind::TimedOut] {
            let system = error(kind);
            assert!(matches!(system, Error::System { .. }), "{system}");
        }
    }
}
