//! The description of a component by its generated code.

use crate::ports::Converter;
use rc_management::component::Role;
use rc_middleware::linked::NodeClock;
use rc_middleware::typed::Operation;
use rc_middleware::{Linked, Qos};
use std::time::Duration;

/// A component, as its generated code describes it.
#[derive(Debug)]
pub struct Description {
    /// The name after `Component` in the `.cdsl`.
    pub name: &'static str,
    /// Hash of the description files.
    pub model_hash: u64,
    /// The middleware of all connections that do not choose one.
    pub middleware: &'static str,
    /// The period of `compute()`, unless the configuration sets another one.
    pub period: Duration,
    /// The parameters as the JSON form of `rc_configuration::model::Parameters`.
    pub parameters: Option<&'static str>,
    /// The folder of the component at build time. Its `etc/config.toml` is the default
    /// configuration.
    pub folder: &'static str,
    /// The connections.
    pub slots: &'static [Slot],
    /// The modules of the types of all connections, each as the JSON form of
    /// `rc_values::description::Module`.
    pub types: &'static [&'static str],
    /// The middlewares of the connections.
    pub backends: &'static [Linked],
    /// Whether the worker can advance the time of its network.
    pub simulates_time: bool,
    /// Whether it has the life cycle of a managed component.
    pub managed: bool,
    /// The code by which its slots convert: [`CONVERTER`](crate::CONVERTER) for a component with a slot
    /// that calls or receives, `None` for others, whose programs are smaller without it.
    pub converter: Option<&'static Converter>,
    /// Note for tools in the executable, see `rc_codegen::note`.
    pub note: &'static [u8],
}

impl Description {
    /// The middleware whose nodes share a time, if the component has one.
    pub(crate) fn node_clock(&self) -> Option<(&'static str, NodeClock)> {
        let mut backends = self.backends.iter();
        backends.find_map(|linked| Some((linked.name, linked.clock?)))
    }
}

/// One end of a connection.
#[derive(Debug)]
pub struct Slot {
    /// The slot's name, unique in the component.
    pub name: &'static str,
    /// Which end of the connection it is.
    pub role: Role,
    /// The interface's name, `Laser`. With the network's name, it is the address of a component
    /// started by hand.
    pub interface: &'static str,
    /// The interface's name with its module, `RoboCompLaser::Laser`.
    pub type_name: &'static str,
    /// Hash over the types of all operations.
    pub type_hash: u64,
    /// The middleware of the connection.
    pub backend: &'static str,
    /// The quality of service.
    pub qos: Qos,
    /// Whether it is an array, whose members the worker opens.
    pub is_array: bool,
    /// The operations, in the order of the IDSL.
    pub operations: &'static [Operation],
    /// The types of the operations for a middleware that has types of its own; else empty.
    pub external_types: &'static [&'static str],
}
