//! The state of a component, as its supervisor sees it.

use serde::{Deserialize, Serialize};
use std::fmt;

/// The state of a component, as its supervisor sees it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ComponentState {
    /// It waits for others to be ready, or for the pause before a restart.
    Waiting,
    /// It runs and is not ready yet.
    Starting,
    /// It runs.
    Running,
    /// It runs `emergency()` in place of `compute()`.
    Emergency,
    /// It ends, by itself or on request.
    Stopping,
    /// It ended with exit code 0, or on request.
    Done,
    /// It ended in another way.
    Failed,
    /// It runs, and its loop has not turned for two seconds.
    Hung,
    /// A command stopped it, and none has started it since.
    Stopped,
}

impl fmt::Display for ComponentState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Waiting => "waiting",
            Self::Starting => "starting",
            Self::Running => "running",
            Self::Emergency => "emergency",
            Self::Stopping => "stopping",
            Self::Done => "done",
            Self::Failed => "failed",
            Self::Hung => "hung",
            Self::Stopped => "stopped",
        })
    }
}
