//! Errors of recordings.

use rc_diagnostics::foreign::without_number;
use std::path::PathBuf;

/// A recording could not be written or read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RecordError {
    /// The disk, the file or its folder refuses.
    #[error("{}: {reason}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// Error text of the system.
        reason: String,
    },
    /// The file is not MCAP.
    #[error("{} is not a recording: {reason}", path.display())]
    NoRecording {
        /// The file.
        path: PathBuf,
        /// Reason of the failure.
        reason: String,
    },
    /// The running network refuses.
    #[error(transparent)]
    Network(#[from] rc_observe::Error),
    /// A table cannot be written.
    #[error("the table cannot be written: {0}")]
    Table(String),
    /// A message or a definition cannot be decoded.
    #[error("{0}")]
    Value(String),
}

impl RecordError {
    /// The file with the reason of the system, without its number.
    pub(crate) fn file(path: &std::path::Path, reason: &impl std::fmt::Display) -> Self {
        Self::File {
            path: path.to_owned(),
            reason: without_number(&reason.to_string()).into_owned(),
        }
    }
}
