//! Errors of recordings.

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
    /// The file is no MCAP.
    #[error("{} is no recording: {reason}", path.display())]
    NoRecording {
        /// The file.
        path: PathBuf,
        /// Reason of the failure.
        reason: String,
    },
    /// The running network refuses.
    #[error(transparent)]
    Network(#[from] rc_observe::Error),
    /// A message or a definition cannot be decoded.
    #[error("{0}")]
    Value(String),
}

impl RecordError {
    /// The file with the reason of the system, without its number.
    pub(crate) fn file(path: &std::path::Path, reason: &impl std::fmt::Display) -> Self {
        Self::File {
            path: path.to_owned(),
            reason: without_number(reason),
        }
    }
}

/// The text of an error of the system, without its number.
pub(crate) fn without_number(reason: &impl std::fmt::Display) -> String {
    let reason = reason.to_string();
    let text = reason.split(" (os error ").next().unwrap_or_default();
    text.to_owned()
}
