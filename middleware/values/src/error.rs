//! The reasons why a description cannot be used, and why bytes, JSON or a value do not fit a type.

use rc_diagnostics::foreign::clean;
use rc_middleware::{DecodeError, EncodeError};
use std::fmt;

/// A description that cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the description of `{place}` cannot be used: {reason}")]
pub struct DescriptionError {
    /// The type, the member or the operation.
    pub place: String,
    /// Reason for the rejection.
    pub reason: String,
}

impl DescriptionError {
    pub(crate) fn new(place: &str, reason: impl fmt::Display) -> Self {
        Self {
            place: clean(place),
            reason: clean(&reason.to_string()),
        }
    }
}

/// Bytes, JSON or a value that does not fit its type.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ValueError {
    /// The member, as in `pose.points[3].x`; empty for the whole value.
    pub path: String,
    /// The mistake, and the allowed form.
    pub reason: String,
}

impl std::error::Error for ValueError {}

impl fmt::Display for ValueError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.path.is_empty() {
            f.write_str(&self.reason)
        } else {
            write!(f, "`{}`: {}", self.path, self.reason)
        }
    }
}

impl From<DecodeError> for ValueError {
    fn from(error: DecodeError) -> Self {
        Self::new(error)
    }
}

impl From<EncodeError> for ValueError {
    fn from(error: EncodeError) -> Self {
        Self::new(error)
    }
}

impl ValueError {
    pub(crate) fn new(reason: impl fmt::Display) -> Self {
        Self {
            path: String::new(),
            reason: reason.to_string(),
        }
    }

    /// The error as the structure sees it that has the member `name`.
    pub(crate) fn in_member(mut self, name: &str) -> Self {
        let dot = if self.path.is_empty() || self.path.starts_with('[') {
            ""
        } else {
            "."
        };
        self.path = format!("{}{dot}{}", clean(name), self.path);
        self
    }

    /// The error as the sequence sees it that has the element `at`.
    pub(crate) fn in_element(mut self, at: impl fmt::Display) -> Self {
        let dot = if self.path.is_empty() || self.path.starts_with('[') {
            ""
        } else {
            "."
        };
        self.path = format!("[{at}]{dot}{}", self.path);
        self
    }
}
