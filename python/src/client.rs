//! A running network without a component: calls of its operations, with the types that its
//! components describe.

use crate::errors;
use crate::samples::Samples;
use crate::types::{Types, Used};
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use rc_observe::{Answer, Topic, call};
use rc_values::Value;
use std::collections::HashMap;
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::sync::{Arc, OnceLock};
use std::time::Duration;

/// How often a wait looks for Ctrl-C.
const LOOK: Duration = Duration::from_millis(100);

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

    /// All operations that can be called: component, slot, operation, and the names of its
    /// parameters.
    fn operations(&self) -> Vec<(String, String, String, Vec<String>)> {
        let all = self.network.operations().into_iter();
        all.map(|operation| {
            let inputs = operation.operation.request.members.iter();
            let inputs = inputs.map(|member| member.name.clone()).collect();
            let server = operation.server;
            (
                server.component,
                server.slot,
                operation.operation.name,
                inputs,
            )
        })
        .collect()
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
        let limit = Duration::try_from_secs_f64(limit).unwrap_or(Duration::MAX);
        let network = self.network.name.clone();
        let answer = interruptible(py, move || call(&network, &found, &request, limit))?;
        match answer.map_err(|error| of_call(py, &error))? {
            // A reply has the name of its operation, as the class of its parts.
            Answer::Result(Value::Struct(ty, values)) => types.answer_object(py, &ty.name, values),
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
        let network = rc_observe::Network {
            name: self.network.name.clone(),
            components: Vec::new(),
            silent: Vec::new(),
        };
        // The description of a topic is that of its last publisher.
        let end = topic.publishers.last().or(topic.subscribers.first());
        let types = Arc::clone(self.types(end.map_or("", |end| &end.component))?);
        Samples::of(py, network, topic, types)
    }
}

impl Network {
    fn types(&self, component: &str) -> PyResult<&Arc<Types>> {
        let missing = || PyRuntimeError::new_err("the classes of the component are not set");
        let all = self.types.get();
        all.and_then(|all| all.get(component)).ok_or_else(missing)
    }
}

/// Does something that takes its time, on a thread of its own, and waits for it without the
/// interpreter's lock. Ctrl-C ends the wait; the thread ends at the limit of what it does.
fn interruptible<T: Send + 'static>(
    py: Python<'_>,
    act: impl FnOnce() -> T + Send + 'static,
) -> PyResult<T> {
    let (done, mut results) = sync_channel(1);
    let thread = std::thread::Builder::new().name("client".to_owned());
    thread.spawn(move || {
        // Nobody may wait any more.
        let _ = done.send(act());
    })?;
    loop {
        let result;
        (results, result) = py.detach(move || {
            let result = results.recv_timeout(LOOK);
            (results, result)
        });
        match result {
            Ok(result) => return Ok(result),
            Err(RecvTimeoutError::Timeout) => py.check_signals()?,
            Err(RecvTimeoutError::Disconnected) => {
                return Err(PyRuntimeError::new_err("the thread of the client panicked"));
            }
        }
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
