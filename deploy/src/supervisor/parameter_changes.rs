//! Unsaved parameter changes of a component, which its next run restores.

use rc_diagnostics::foreign::clean;
use rc_management::link::{SupervisorMessage, UnsavedParameters};
use rc_management::rpc;

/// The last report of a component about its unsaved changes.
#[derive(Debug, Default)]
pub(crate) struct Changes(UnsavedParameters);

impl Changes {
    pub(crate) fn new(unsaved: UnsavedParameters) -> Self {
        Self(unsaved)
    }

    /// The first line for a new run. `None` if there is nothing to restore.
    pub(crate) fn line(&self) -> Option<String> {
        let changes = self.0.changed.clone();
        (!changes.is_empty()).then(|| {
            let line = rpc::notification(&SupervisorMessage::Restore { changes });
            String::from_utf8_lossy(&line).into_owned()
        })
    }

    /// The message about restored changes.
    pub(crate) fn restored(&self) -> String {
        let paths: Vec<String> = self.0.changed.keys().map(|path| clean(path)).collect();
        format!("has its changed parameters again: {}", paths.join(", "))
    }

    /// The message about changes that cannot be restored: only the component knows them. It is
    /// returned once.
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
