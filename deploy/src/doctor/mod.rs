//! `rcdeploy doctor`: usual problems of a new machine, each with its fix.
//!
//! The checks read files and ask the system. They change nothing and need no rights.

mod hosts;
mod logout;
mod machine;
mod network;

pub(crate) use hosts::{of_host, processor};
pub(crate) use logout::Logout;
pub(crate) use machine::Machine;

use serde::Serialize;
use std::fmt;

/// How severe a finding is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Grade {
    /// Fit for networks.
    Ok,
    /// Some networks fail, or fail later.
    Warning,
    /// Networks fail.
    Error,
}

/// The result of one check.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub(crate) struct Finding {
    /// The subject of the check.
    pub(crate) check: String,
    pub(crate) grade: Grade,
    pub(crate) found: String,
    /// The remedy.
    #[serde(rename = "mend", skip_serializing_if = "Option::is_none")]
    pub(crate) fix: Option<String>,
}

impl Finding {
    fn ok(check: &str, found: impl Into<String>) -> Self {
        Self {
            check: check.to_owned(),
            grade: Grade::Ok,
            found: found.into(),
            fix: None,
        }
    }

    fn warning(check: &str, found: impl Into<String>, fix: impl Into<String>) -> Self {
        Self {
            grade: Grade::Warning,
            fix: Some(fix.into()),
            ..Self::ok(check, found)
        }
    }

    fn error(check: &str, found: impl Into<String>, fix: impl Into<String>) -> Self {
        Self {
            grade: Grade::Error,
            ..Self::warning(check, found, fix)
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
        match &self.fix {
            Some(fix) => writeln!(f, "{:24} fix: {fix}", ""),
            None => Ok(()),
        }
    }
}
