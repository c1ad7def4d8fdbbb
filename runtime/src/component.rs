//! What a generated component tells the runtime, and what the runtime asks of it.

use crate::Core;
use rc_configuration::{ParamChange, Values};
use rc_middleware::typed::{HandlerError, Operation, Request};
use rc_middleware::{Backend, Environment, OpenError, Qos, Reader};
use std::time::Duration;

/// Opens a backend; generated code names the functions of the backends that it was generated for.
pub type Connect = fn(&Environment) -> Result<Box<dyn Backend>, OpenError>;

/// Everything that is known of a component when it is generated.
#[derive(Debug)]
pub struct Description {
    /// The name after `Component`.
    pub name: &'static str,
    /// Hash of the description files.
    pub model_hash: u64,
    /// The middleware of all connections that do not choose one.
    pub middleware: &'static str,
    /// How often `compute()` runs where the configuration does not say.
    pub period: Duration,
    /// The parameters as the JSON form of `rc_configuration::model::Parameters`.
    pub parameters: Option<&'static str>,
    /// The folder of the component where it was built; its `etc/config.toml` is the default configuration.
    pub folder: &'static str,
    /// Its connections.
    pub slots: &'static [Slot],
    /// The middlewares that its connections use.
    pub backends: &'static [(&'static str, Connect)],
    /// What tools find in the executable, see `rc_codegen::note`.
    pub note: &'static [u8],
}

/// One end of a connection.
#[derive(Debug)]
pub struct Slot {
    /// Its name, unique in the component.
    pub name: &'static str,
    /// Which end.
    pub role: Role,
    /// `Laser`: with the network's name, the address by hand.
    pub interface: &'static str,
    /// `RoboCompLaser::Laser`
    pub type_name: &'static str,
    /// Hash over the types of all operations.
    pub type_hash: u64,
    /// The middleware of this connection.
    pub backend: &'static str,
    /// Its quality of service.
    pub qos: Qos,
    /// Its operations, in the order of the IDSL.
    pub operations: &'static [Operation],
    /// What their types are called by a middleware that has types of its own; else empty.
    pub external_types: &'static [&'static str],
}

/// The four ends of connections.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// Answers calls.
    Implements,
    /// Calls.
    Requires,
    /// Sends to topics, one an operation.
    Publishes,
    /// Receives from topics, one an operation.
    SubscribesTo,
}

impl Role {
    /// The word of the CDSL.
    pub fn word(self) -> &'static str {
        match self {
            Self::Implements => "implements",
            Self::Requires => "requires",
            Self::Publishes => "publishes",
            Self::SubscribesTo => "subscribesTo",
        }
    }
}

/// A worker with its context, as generated code joins them.
pub trait Component {
    /// What the runtime knows of this component while it runs.
    fn core(&mut self) -> &mut Core;

    /// The user's `compute()`.
    fn compute(&mut self) -> Result<(), WorkerError>;

    /// Gives the context these values of its parameters.
    fn set_parameters(&mut self, values: &Values) {
        let _ = values;
    }

    /// The user's `params_changed()`, after [`Component::set_parameters`]; an error refuses the changes.
    fn parameters_changed(&mut self, changes: &[ParamChange]) -> Result<(), WorkerError> {
        let _ = changes;
        Ok(())
    }

    /// Takes the place of `compute()` in the state Emergency.
    fn emergency(&mut self);

    /// Between Emergency and Running.
    fn restore(&mut self);

    /// The last call.
    fn finalize(&mut self);

    /// Writes how many peers the sending slots have, each at the number of its slot.
    fn sending_peers(&self, peers: &mut [usize]);

    /// Answers a request at an implemented slot.
    fn serve(&mut self, slot: usize, request: &mut Request<'_>) -> Result<(), HandlerError>;

    /// Takes a value of a subscribed topic.
    fn receive(
        &mut self,
        slot: usize,
        operation: usize,
        reader: &mut Reader<'_>,
    ) -> Result<(), HandlerError>;
}

/// What a worker can answer when it could not do its work. Every error converts into `Failed`.
#[derive(Debug)]
pub enum WorkerError {
    /// Logged and counted; the next period comes.
    Failed(String),
    /// The component goes into the state Emergency, where `emergency` runs instead of `compute`.
    Emergency(String),
    /// The component ends with exit code 3.
    Fatal(String),
}

impl<E: std::error::Error> From<E> for WorkerError {
    fn from(error: E) -> Self {
        let mut message = error.to_string();
        let mut source = error.source();
        while let Some(inner) = source {
            message = format!("{message}: {inner}");
            source = inner.source();
        }
        Self::Failed(message)
    }
}

impl std::fmt::Display for WorkerError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (Self::Failed(reason) | Self::Emergency(reason) | Self::Fatal(reason)) = self;
        f.write_str(reason)
    }
}
