//! Unsaved parameter changes of a component, which its next run restores.

use rc_diagnostics::foreign::clean;
use rc_management::component::{Changed, overlap};
use rc_management::link::{SupervisorMessage, UnsavedParameters};
use rc_management::rpc;
use serde_json::{Map, Value};

/// The last report of a component about its unsaved changes.
#[derive(Debug, Default)]
pub(crate) struct Changes(UnsavedParameters);

impl Changes {
    pub(crate) fn new(unsaved: UnsavedParameters) -> Self {
        Self(unsaved)
    }

    /// The first line for a new run, which also names the parameters that rules of the network
    /// read. `None` if there are none, and nothing is to be restored.
    pub(crate) fn line(&self, ruled: &[String]) -> Option<String> {
        let changes = self.0.changed.clone();
        (!changes.is_empty() || !ruled.is_empty()).then(|| {
            let ruled = ruled.to_vec();
            let line = rpc::notification(&SupervisorMessage::Restore { changes, ruled });
            String::from_utf8_lossy(&line).into_owned()
        })
    }

    /// Keeps what rules of the network read, and forgets the rest.
    pub(crate) fn keep_only(&mut self, ruled: &[String]) {
        let is_ruled = |path: &str| ruled.iter().any(|ruled| overlap(path, ruled));
        self.0.changed.retain(|path, _| is_ruled(path));
        self.0.unkept.retain(|path| is_ruled(path));
    }

    /// Adds a change that all components keep, before the component reports it: it may end first.
    /// A secret stays in its process.
    pub(crate) fn keep(&mut self, changes: &Map<String, Value>, accepted: &Changed) {
        let all = accepted.changed.iter().chain(&accepted.pending);
        let secret = all.filter(|change| change.new == "***");
        let secret: Vec<&String> = secret.map(|change| &change.path).collect();
        for (path, value) in changes {
            if secret.iter().any(|secret| overlap(secret, path)) {
                self.0.unkept.push(path.clone());
            } else {
                self.0.changed.insert(path.clone(), value.clone());
            }
        }
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
