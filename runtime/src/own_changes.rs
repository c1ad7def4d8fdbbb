//! Changes of parameters that the worker itself requests.

use crate::parameter_service::RequestQueue;
use rc_configuration::model::Value;
use std::fmt;
use std::sync::Arc;

/// Where the requests of a worker go.
pub(crate) enum OwnChanges {
    /// To the management thread, which checks them as those of tools.
    Requested(Arc<RequestQueue>),
    /// To the test of a worker: paths and values.
    Kept(Vec<(String, Value)>),
    /// Nowhere: a run that is repeated has the changes of its recording.
    Repeated,
}

impl OwnChanges {
    /// Requests a change.
    ///
    /// # Errors
    /// Too many wait.
    pub(crate) fn request(&mut self, path: &str, value: Value) -> Result<(), String> {
        match self {
            Self::Requested(queue) => return queue.request_own(path, value.to_json()),
            Self::Kept(kept) => kept.push((path.to_owned(), value)),
            Self::Repeated => {}
        }
        Ok(())
    }

    /// Whether a change that was requested was neither made nor refused.
    pub(crate) fn are_open(&self) -> bool {
        matches!(self, Self::Requested(queue) if queue.has_own())
    }
}

impl fmt::Debug for OwnChanges {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = match self {
            Self::Requested(_) => "Requested",
            Self::Kept(_) => "Kept",
            Self::Repeated => "Repeated",
        };
        f.write_str(name)
    }
}
