//! Parameters that were changed while a component ran, and not saved: its next run gets them again.

use serde_json::{Map, Value, json};

/// What one component has changed, as it said last.
#[derive(Debug, Default)]
pub(crate) struct Changes {
    changed: Map<String, Value>,
    unkept: Vec<String>,
}

impl Changes {
    pub(crate) fn new(changed: Map<String, Value>, unkept: Vec<String>) -> Self {
        Self { changed, unkept }
    }

    /// What a new run is told as its first line; none where nothing is to be restored.
    pub(crate) fn line(&self) -> Option<String> {
        let changes = &self.changed;
        (!changes.is_empty()).then(|| {
            let params = json!({ "changes": changes });
            let line = json!({ "jsonrpc": "2.0", "method": "restore", "params": params });
            format!("{line}\n")
        })
    }

    /// A text of what was set again.
    pub(crate) fn restored(&self) -> String {
        let paths: Vec<&str> = self.changed.keys().map(String::as_str).collect();
        format!("has its changed parameters again: {}", paths.join(", "))
    }

    /// A text of what was not, since the component keeps it for itself. It is told once.
    pub(crate) fn lost(&mut self) -> Option<String> {
        let unkept = std::mem::take(&mut self.unkept);
        (!unkept.is_empty()).then(|| {
            format!(
                "changed parameters that are secret, or too long, were not restored: {}; they are as in the configuration",
                unkept.join(", ")
            )
        })
    }
}
