//! What bites on a new machine, each thing with its mend: `rcdeploy doctor`.
//!
//! The checks read files and ask the system. They change nothing and need no rights.

mod hosts;
mod machine;

pub(crate) use hosts::of_host;
pub(crate) use machine::Machine;

use serde::Serialize;
use std::fmt;

/// How grave a finding is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Grade {
    /// As networks need it.
    Ok,
    /// Some networks fail, or fail later.
    Warning,
    /// Networks fail.
    Error,
}

/// What one check found.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub(crate) struct Finding {
    /// The subject of the check.
    pub(crate) check: String,
    pub(crate) grade: Grade,
    pub(crate) found: String,
    /// What to do about it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) mend: Option<String>,
}

impl Finding {
    fn ok(check: &str, found: impl Into<String>) -> Self {
        Self {
            check: check.to_owned(),
            grade: Grade::Ok,
            found: found.into(),
            mend: None,
        }
    }

    fn warning(check: &str, found: impl Into<String>, mend: impl Into<String>) -> Self {
        Self {
            grade: Grade::Warning,
            mend: Some(mend.into()),
            ..Self::ok(check, found)
        }
    }

    fn error(check: &str, found: impl Into<String>, mend: impl Into<String>) -> Self {
        Self {
            grade: Grade::Error,
            ..Self::warning(check, found, mend)
        }
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let grade = match self.grade {
            Grade::Ok => "ok",
            Grade::Warning => "warning",
            Grade::Error => "error",
        };
        writeln!(f, "{grade:8} {:15} {}", self.check, self.found)?;
        match &self.mend {
            Some(mend) => writeln!(f, "{:24} mend: {mend}", ""),
            None => Ok(()),
        }
    }
}
