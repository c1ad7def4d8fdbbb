//! A running network without a component: calls of its operations, with the types that its
//! components describe.

use crate::errors;
use crate::publisher::Publisher;
use crate::samples::Samples;
use crate::types::{Types, Used};
use crate::waiting::interruptible;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use rc_deploy_client::params;
use rc_observe::{Answer, Topic, call};
use rc_values::Value;
use std::collections::HashMap;
use std::sync::{Arc, OnceLock};
use std::time::Duration;

/// A running network.
#[pyclass(frozen, module = "robocomp._native")]
pub(crate) struct Network {
    network: rc_observe::Network,
    /// The types of each component.
    types: OnceLock<HashMap<String, Arc<Types>>>,
}

#[pymethods]
impl Network {
    /// Asks the components of a network for their descriptions.
    #[new]
    fn new(py: Python<'_>, name: &str) -> PyResult<Self> {
        let name = name.to_owned();
        let network = interruptible(py, move || rc_observe::Network::look(&name))?;
        Ok(Self {
            network: network.map_err(|error| failed(py, &error))?,
            types: OnceLock::new(),
        })
    }

    /// The descriptions of the modules of each component, as JSON.
    fn modules(&self) -> Vec<(String, Vec<String>)> {
        let components = self.network.components.iter();
        let modules = components.map(|component| {
            let types = component.described.types.iter().map(ToString::to_string);
            (component.name.clone(), types.collect())
        });
        modules.collect()
    }

    /// Takes the classes of the types of each component.
    fn set_types(&self, classes: HashMap<String, Bound<'_, PyDict>>) -> PyResult<()> {
        let mut all = HashMap::new();
        for (name, classes) in classes {
            let Some(component) = self.network.component(&name) else {
                continue;
            };
            let slots = component.described.slots.iter();
            let interfaces = slots.filter_map(|slot| component.catalog.interface(&slot.interface));
            let used = interfaces.flat_map(|interface| {
                interface.operations.iter().map(|operation| Used {
                    answer: format!("{}.{}", interface.name, operation.name),
                    request: &operation.request,
                    reply: &operation.reply,
                    throws: &operation.throws,
                })
            });
            all.insert(name, Types::of(&classes, used)?);
        }
        // The constructor of Python sets them once.
        let _ = self.types.set(all);
        Ok(())
    }

    /// All operations that can be called: component, slot, interface and operation.
    fn operations(&self) -> Vec<(String, String, String, String)> {
        let mut all = Vec::new();
        for service in self.network.services() {
            for server in &service.servers {
                for operation in &service.interface.operations {
                    all.push((
                        server.component.clone(),
                        server.slot.clone(),
                        service.interface.name.clone(),
                        operation.name.clone(),
                    ));
                }
            }
        }
        all
    }

    /// The names of the components.
    fn components(&self) -> Vec<String> {
        self.network
            .components
            .iter()
            .map(|c| c.name.clone())
            .collect()
    }

    /// The names of the topics.
    fn topics(&self) -> Vec<String> {
        self.network.topics().iter().map(Topic::name).collect()
    }

    /// Calls an operation by its whole name. `limit` is in seconds.
    fn call<'py>(
        &self,
        py: Python<'py>,
        operation: &str,
        arguments: &Bound<'py, PyTuple>,
        limit: f64,
    ) -> PyResult<Bound<'py, PyAny>> {
        let operations = self.network.operations().into_iter();
        let Some(found) = { operations }.find(|known| known.name() == operation) else {
            let message = format!("there is no operation `{operation}`");
            return Err(errors::raise(py, "Error", &message));
        };
        let types = self.types(&found.server.component)?;
        let of = &found.operation;
        let request = types.arguments(&of.request, arguments).map_err(|misfit| {
            let message = format!("{}(): {misfit}", of.name);
            errors::raise(py, "InvalidArgument", &message)
        })?;
        let has_result = of.has_result;
        let limit = Duration::try_from_secs_f64(limit).unwrap_or(Duration::MAX);
        let network = self.network.name.clone();
        let answer = interruptible(py, move || call(&network, &found, &request, limit))?;
        match answer.map_err(|error| of_call(py, &error))? {
            // A reply has the name of its operation, as the class of its parts.
            Answer::Result(Value::Struct(ty, values)) => {
                types.answer_object(py, &ty.name, has_result, values)
            }
            Answer::Result(_) => Ok(py.None().into_bound(py)),
            Answer::Exception(value) => Err(PyErr::from_value(types.object(py, value)?)),
        }
    }

    /// Listens to a topic by its name.
    fn listen(&self, py: Python<'_>, topic: &str) -> PyResult<Samples> {
        let topic = self
            .network
            .topic(topic)
            .map_err(|error| failed(py, &error))?;
        let types = Arc::clone(self.types(describes(&topic))?);
        Samples::of(py, self.bare(), topic, types)
    }

    /// Opens a topic for sending. Returns its name, and the component, the interface and the
    /// operation that describe it.
    fn publisher(
        &self,
        py: Python<'_>,
        topic: &str,
    ) -> PyResult<(Publisher, String, String, String, String)> {
        let topic = self.network.topic(topic);
        let topic = topic.map_err(|error| failed(py, &error))?;
        let component = describes(&topic).to_owned();
        let types = Arc::clone(self.types(&component)?);
        let (name, interface) = (topic.name(), topic.interface.name.clone());
        let operation = topic.operation.name.clone();
        let publisher = Publisher::open(py, self.bare(), topic, types)?;
        Ok((publisher, name, component, interface, operation))
    }

    /// The parameters of a component, as JSON.
    fn parameters(&self, py: Python<'_>, component: &str) -> PyResult<String> {
        let listed = self.of_component(py, component, |network, component| {
            params::list(network, component, &[])
        })?;
        serde_json::to_string(&listed).map_err(|error| PyRuntimeError::new_err(error.to_string()))
    }

    /// Changes parameters of a component, all or none. `changes` is a table in JSON.
    fn set_parameters(&self, py: Python<'_>, component: &str, changes: &str) -> PyResult<()> {
        let changes: serde_json::Map<String, serde_json::Value> =
            serde_json::from_str(changes).map_err(|e| PyRuntimeError::new_err(e.to_string()))?;
        let changed = self.of_component(py, component, move |network, component| {
            params::set(network, component, &changes)
        });
        changed.map(drop)
    }

    /// Writes the changed parameters of a component into its configuration.
    fn save_parameters(&self, py: Python<'_>, component: &str) -> PyResult<()> {
        self.of_component(py, component, params::save).map(drop)
    }
}

/// The component that describes a topic: its last publisher, else a subscriber.
fn describes(topic: &Topic) -> &str {
    let end = topic.publishers.last().or(topic.subscribers.first());
    end.map_or("", |end| &end.component)
}

impl Network {
    /// The network without its components, for a thread that opens a topic.
    fn bare(&self) -> rc_observe::Network {
        rc_observe::Network {
            name: self.network.name.clone(),
            components: Vec::new(),
            silent: Vec::new(),
        }
    }

    /// Asks a component for something about its parameters.
    fn of_component<T: Send + 'static>(
        &self,
        py: Python<'_>,
        component: &str,
        ask: impl FnOnce(&str, &str) -> Result<T, rc_deploy_client::Error> + Send + 'static,
    ) -> PyResult<T> {
        let (network, component) = (self.network.name.clone(), component.to_owned());
        let outcome = interruptible(py, move || ask(&network, &component))?;
        outcome.map_err(|error| errors::raise(py, "Error", &error.to_string()))
    }

    fn types(&self, component: &str) -> PyResult<&Arc<Types>> {
        let missing = || PyRuntimeError::new_err("the classes of the component are not set");
        let all = self.types.get();
        all.and_then(|all| all.get(component)).ok_or_else(missing)
    }
}

fn failed(py: Python<'_>, error: &rc_observe::Error) -> PyErr {
    errors::raise(py, "Error", &error.to_string())
}

/// The exception for a call that failed: the class that a worker gets, and `CallError` for what
/// only a client meets.
fn of_call(py: Python<'_>, error: &rc_observe::Error) -> PyErr {
    let name = match error {
        rc_observe::Error::Refused { .. } => "Refused",
        rc_observe::Error::Deadline { .. } => "Deadline",
        rc_observe::Error::Unavailable { .. } => "Unavailable",
        rc_observe::Error::NoServer { .. } => "NoServer",
        rc_observe::Error::ServerDied { .. } => "ServerDied",
        rc_observe::Error::Value(_) => "MalformedReply",
        rc_observe::Error::Open(_) | rc_observe::Error::System { .. } => "MiddlewareError",
        _ => "CallError",
    };
    let raised = errors::raise(py, name, &error.to_string());
    if let rc_observe::Error::Unavailable { state, .. } = error {
        // Without the attribute, the message still has the state.
        let _ = raised.value(py).setattr("state", state);
    }
    raised
}
