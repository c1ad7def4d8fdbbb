//! Parameters that were changed while a component ran, and not saved: its next run gets them again.

use rc_management::link::{SupervisorMessage, UnsavedParameters};
use rc_management::rpc;

/// What one component has changed, as it said last.
#[derive(Debug, Default)]
pub(crate) struct Changes(UnsavedParameters);

impl Changes {
    pub(crate) fn new(unsaved: UnsavedParameters) -> Self {
        Self(unsaved)
    }

    /// What a new run is told as its first line; none where nothing is to be restored.
    pub(crate) fn line(&self) -> Option<String> {
        let changes = self.0.changed.clone();
        (!changes.is_empty()).then(|| {
            let line = rpc::notification(&SupervisorMessage::Restore { changes });
            String::from_utf8_lossy(&line).into_owned()
        })
    }

    /// A text of what was set again.
    pub(crate) fn restored(&self) -> String {
        let paths: Vec<&str> = self.0.changed.keys().map(String::as_str).collect();
        format!("has its changed parameters again: {}", paths.join(", "))
    }

    /// A text of what was not, since the component keeps it for itself. It is told once.
    pub(crate) fn lost(&mut self) -> Option<String> {
        let unkept = std::mem::take(&mut self.0.unkept);
        (!unkept.is_empty()).then(|| {
            format!(
                "changed parameters that are secret, or too long, were not restored: {}; they are as in the configuration",
                unkept.join(", ")
            )
        })
    }
}
