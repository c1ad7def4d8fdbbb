//! Processes that the supervisor of an agent starts, and those that run.

use crate::process::launch::LocalProcess;
use rc_deploy_network::plan::Component;
use std::collections::BTreeMap;

/// A component that its supervisor starts.
pub(super) struct Starting {
    pub(super) component: Box<Component>,
    pub(super) greeting: Option<String>,
    pub(super) after: Vec<String>,
}

/// A process that its supervisor starts: its components, of which there is at least one.
pub(super) struct Start {
    pub(super) run: String,
    pub(super) components: Vec<Starting>,
}

impl Start {
    /// Name of the process.
    pub(super) fn process(&self) -> &str {
        let first = self.components.first();
        first.map_or("", |first| first.component.process())
    }
}

/// A process that runs.
pub(super) struct Running {
    pub(super) run: String,
    /// The process as each of its components has it.
    pub(super) components: BTreeMap<String, LocalProcess>,
}

impl Running {
    /// The process, of which its components have parts.
    pub(super) fn process(&self) -> Option<&LocalProcess> {
        self.components.values().next()
    }
}
