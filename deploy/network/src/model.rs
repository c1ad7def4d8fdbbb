//! A network with everything that its `.ddsl` names.

use crate::addresses::Addresses;
use crate::chains::{CheckedChain, Port};
use crate::network_time::ClockPlan;
use crate::parameters::OverriddenParameters;
use crate::programs::Programs;
use crate::proxies::Proxies;
use rc_cdsl::model::{Middleware, Slot};
use rc_codegen::Project;
use rc_ddsl::model::{Deployment, Setting};
use rc_ddsl::{Endpoint, Network as Connections};
use std::collections::HashMap;
use std::path::PathBuf;
use std::rc::Rc;
use std::time::Duration;

/// The component that publishes the time of a network, and those that follow it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NetworkTime {
    /// The source: an index into the instances.
    pub source: usize,
    /// The followers in the order of their turns, that of the file, each with the middleware over
    /// which it receives the time.
    pub followers: Vec<(usize, Middleware)>,
}

/// A network, as far as it could be parsed.
#[derive(Debug)]
pub struct Network {
    /// The `.ddsl`.
    pub path: PathBuf,
    /// The parsed description.
    pub deployment: Rc<Deployment>,
    /// The component of each instance, with a slot for each member of its slot arrays. `None` if
    /// its files could not be read. Instances of one component without arrays share it.
    pub projects: Vec<Option<Rc<Project>>>,
    /// The connections.
    pub connections: Connections,
    /// The source of time and its followers. `None` if a component does not publish it.
    pub time: Option<NetworkTime>,
    /// The clock of each instance.
    pub clocks: Vec<ClockPlan>,
    /// The programs of the instances.
    pub programs: Programs,
    /// The components of proxies, whose slot arrays are not replaced by their members.
    pub(crate) proxies: Proxies,
    pub(crate) addresses: Addresses,
    /// For each instance, the values that the network sets, and those that are in effect.
    pub(crate) parameters: Vec<OverriddenParameters>,
    /// For each instance, the period of its `compute()`.
    pub(crate) periods: Vec<Duration>,
    /// The chains that were found, with their worst cases.
    pub chains: Vec<CheckedChain>,
    /// For each instance, the middleware settings that its configuration leaves open.
    pub(crate) passed_settings: Vec<Vec<Setting>>,
    /// For each source file, the instances of the components that it belongs to.
    pub texts: HashMap<PathBuf, Vec<usize>>,
}

/// A profile of cargo.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Profile {
    /// Optimised: `target/release`.
    Release,
    /// Unoptimised: `target/debug`.
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

    /// The name for cargo's `--profile`.
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

    /// The slot of an endpoint, if its component could be read.
    pub fn slot(&self, end: Endpoint) -> Option<&Slot> {
        let project = self.projects.get(end.instance)?.as_ref()?;
        project.component.slots.get(end.slot)
    }

    /// `COMPONENT.SLOT.OPERATION`
    pub fn port_name(&self, port: Port) -> String {
        let path = &self.deployment.instances[port.instance].path;
        match self.port_words(port) {
            Some((slot, operation)) => format!("{path}.{slot}.{operation}"),
            None => path.clone(),
        }
    }

    /// The slot and the operation of a port; `None` of a component that could not be read.
    pub(crate) fn port_words(&self, port: Port) -> Option<(&str, &str)> {
        let component = &self.projects[port.instance].as_deref()?.component;
        let slot = &component.slots[port.slot];
        let operations = &component.library.interface(slot.interface).operations;
        Some((&slot.name, &operations[port.operation].name.text))
    }
}
