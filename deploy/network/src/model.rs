//! A network with everything that its `.ddsl` names.

use crate::workspaces::Workspaces;
use rc_cdsl::model::{Backend, Slot};
use rc_codegen::Project;
use rc_ddsl::model::{Deployment, Setting};
use rc_ddsl::{Endpoint, Network as Connections};
use std::collections::HashMap;
use std::path::PathBuf;
use std::rc::Rc;

/// A network, as far as it could be read.
#[derive(Debug)]
pub struct Network {
    /// The `.ddsl`.
    pub path: PathBuf,
    /// What it says.
    pub deployment: Deployment,
    /// One entry for each instance, none where its files could not be read. Instances of one
    /// component share it.
    pub projects: Vec<Option<Rc<Project>>>,
    /// Who talks to whom.
    pub connections: Connections,
    /// The middleware that all components were loaded for, whatever the files say.
    pub(crate) middleware: Option<Backend>,
    /// The middleware that each instance is a variant for; none where its program is made of the
    /// code in its folder, or is named.
    pub(crate) variants: Vec<Option<Backend>>,
    /// What each instance has to be told of middlewares: what its configuration does not say
    /// itself.
    pub(crate) passed_settings: Vec<Vec<Setting>>,
    /// For each file that components are made of, these components.
    pub texts: HashMap<PathBuf, Vec<usize>>,
    /// Where cargo builds the components.
    pub(crate) workspaces: Workspaces,
}

/// What `cargo build` makes of a workspace.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Profile {
    /// With optimisation, in `target/release`.
    Release,
    /// Quickly built, in `target/debug`.
    Dev,
}

impl Profile {
    /// The folder under `target/`.
    pub fn folder(self) -> &'static str {
        match self {
            Self::Release => "release",
            Self::Dev => "debug",
        }
    }

    /// The word of cargo's `--profile`.
    pub fn word(self) -> &'static str {
        match self {
            Self::Release => "release",
            Self::Dev => "dev",
        }
    }
}

impl std::str::FromStr for Profile {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "release" => Ok(Self::Release),
            "dev" => Ok(Self::Dev),
            other => Err(format!(
                "`{other}` is not a profile; there are release and dev"
            )),
        }
    }
}

impl Network {
    /// The name of the network.
    pub fn name(&self) -> &str {
        &self.deployment.name.text
    }

    /// The slot of one end, where its component could be read.
    pub fn slot(&self, end: Endpoint) -> Option<&Slot> {
        let project = self.projects.get(end.instance)?.as_ref()?;
        project.component.slots.get(end.slot)
    }
}
