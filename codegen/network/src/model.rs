//! A network with everything that its `.ddsl` names.

use crate::chains::{CheckedChain, Port};
use crate::parameters::OverriddenParameters;
use crate::programs::Programs;
use rc_cdsl::model::{Middleware, Slot};
use rc_codegen::Project;
use rc_codegen::proxies::Proxies;
use rc_codegen::world::World;
use rc_ddsl::model::{Deployment, Instance, Setting};
use rc_ddsl::{Endpoint, Network as Connections};
use serde::Serialize;
use std::collections::{BTreeMap, HashMap};
use std::fmt;
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

/// The clock of a component.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct ClockPlan {
    /// `system`, `simulated`, `source` or `ros`.
    pub kind: &'static str,
    /// The component that publishes the time, if another one does.
    pub source: Option<String>,
    /// The middleware over which it receives the time.
    pub middleware: Option<&'static str>,
}

impl fmt::Display for ClockPlan {
    /// `simulated by clock over dds`
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.kind, &self.source, self.middleware) {
            ("source", ..) => f.write_str("publishes the network's time"),
            ("ros", ..) => f.write_str("/clock of ROS 2"),
            (kind, Some(source), Some(middleware)) => {
                write!(f, "{kind} by {source} over {middleware}")
            }
            (kind, ..) => f.write_str(kind),
        }
    }
}

/// The addresses of the slots of a network.
#[derive(Debug, Default)]
pub(crate) struct Addresses {
    /// For each slot, the slot whose address it has.
    pub(crate) leaders: BTreeMap<Endpoint, Endpoint>,
    pub(crate) of: BTreeMap<Endpoint, String>,
}

impl Addresses {
    /// The address of a slot of a component that was read. Each has one.
    pub(crate) fn of(&self, end: Endpoint) -> &str {
        &self.of[&end]
    }

    /// All slots with their addresses.
    pub(crate) fn iter(&self) -> impl Iterator<Item = (Endpoint, &str)> {
        let all = self.of.iter();
        all.map(|(end, address)| (*end, address.as_str()))
    }
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
    /// The longest time of a message over each middleware that was measured on this machine.
    pub(crate) transports: Vec<(Middleware, Duration)>,
    /// For each instance, the middleware settings that its configuration leaves open.
    pub(crate) passed_settings: Vec<Vec<Setting>>,
    /// For each source file, the instances of the components that it belongs to.
    pub texts: HashMap<PathBuf, Vec<usize>>,
    /// The files that parameters name, as far as their contents were checked.
    pub files: Vec<PathBuf>,
    /// The schema of its world.
    pub(crate) world: Option<World>,
}

impl Network {
    /// The name of the network.
    pub fn name(&self) -> &str {
        &self.deployment.name.text
    }

    /// The address of a slot. `None` if its component could not be read.
    pub fn address(&self, end: Endpoint) -> Option<&str> {
        self.addresses.of.get(&end).map(String::as_str)
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

    /// The slot and the operation of a port; `None` for a component that could not be read.
    pub(crate) fn port_words(&self, port: Port) -> Option<(&str, &str)> {
        let component = &self.projects[port.instance].as_deref()?.component;
        let slot = &component.slots[port.slot];
        let operations = &component.library.interface(slot.interface).operations;
        Some((&slot.name, &operations[port.operation].name.text))
    }

    /// The names of the components behind the proxy `at`; empty for other components.
    pub(crate) fn behind(&self, at: usize) -> Vec<String> {
        let instances = &self.deployment.instances;
        let Some(group) = instances[at].proxy else {
            return Vec::new();
        };
        // Adaptors inside come after all components of the file.
        let is_inside = |other: &&Instance| self.deployment.is_inside(other.group, Some(group));
        let inside = instances.iter().filter(is_inside);
        inside.map(|inside| inside.path.clone()).collect()
    }
}
