//! A running network without a component: calls of its operations and the messages of its topics,
//! with the types that its components describe.

use crate::errors;
use crate::types::{Types, Used};
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use rc_observe::{Answer, Observer, Topic, call};
use rc_values::Value;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::time::{Duration, Instant};

/// The most samples that wait for the program.
const WAITING: usize = 64;
/// The longest wait before signals are handled.
const TURN: Duration = Duration::from_millis(100);

/// A running network.
#[pyclass(frozen, module = "robocomp._native")]
pub(crate) struct Network {
    network: rc_observe::Network,
    types: OnceLock<Arc<Types>>,
}

#[pymethods]
impl Network {
    /// Asks the components of a network for their descriptions.
    #[new]
    fn new(py: Python<'_>, name: &str) -> PyResult<Self> {
        let network = py.detach(|| rc_observe::Network::look(name));
        Ok(Self {
            network: network.map_err(|error| failed(py, &error))?,
            types: OnceLock::new(),
        })
    }

    /// The descriptions of all modules, as JSON.
    fn modules(&self) -> Vec<String> {
        let components = self.network.components.iter();
        let modules = components.flat_map(|component| &component.described.types);
        modules.map(ToString::to_string).collect()
    }

    /// Takes the classes of all types.
    fn set_types(&self, classes: &Bound<'_, PyDict>) -> PyResult<()> {
        let topics = self.network.topics();
        let topics = topics
            .iter()
            .map(|topic| (&topic.interface.name, &topic.operation));
        let services = self.network.services();
        let services = services.iter().flat_map(|service| {
            let operations = service.interface.operations.iter();
            operations.map(|operation| (&service.interface.name, operation))
        });
        let used = topics.chain(services).map(|(interface, operation)| Used {
            answer: format!("{interface}.{}", operation.name),
            request: &operation.request,
            reply: &operation.reply,
            throws: &operation.throws,
        });
        let types = Types::of(classes, used)?;
        // The constructor of Python sets them once.
        let _ = self.types.set(types);
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
        let types = self.types()?;
        let of = &found.operation;
        let request = types.arguments(&of.request, arguments).map_err(|misfit| {
            let message = format!("{}(): {misfit}", of.name);
            errors::raise(py, "InvalidArgument", &message)
        })?;
        let limit = Duration::try_from_secs_f64(limit).unwrap_or(Duration::MAX);
        let answer = py.detach(|| call(&self.network.name, &found, &request, limit));
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
        let (sender, samples) = sync_channel(WAITING);
        let (opened, opens) = sync_channel(1);
        let ends = Arc::new(AtomicBool::new(false));
        std::thread::Builder::new()
            .name("topic".to_owned())
            .spawn({
                let ends = Arc::clone(&ends);
                move || listen(&network, &topic, &opened, &sender, &ends)
            })?;
        let outcome = py.detach(move || opens.recv());
        let outcome = outcome.unwrap_or_else(|_| Err("the thread of the topic ended".to_owned()));
        outcome.map_err(|reason| errors::raise(py, "Error", &reason))?;
        Ok(Samples {
            queue: Mutex::new(samples),
            ends,
            types: Arc::clone(self.types()?),
        })
    }
}

impl Network {
    fn types(&self) -> PyResult<&Arc<Types>> {
        let missing = || PyRuntimeError::new_err("the classes of the network are not set");
        self.types.get().ok_or_else(missing)
    }
}

fn failed(py: Python<'_>, error: &rc_observe::Error) -> PyErr {
    errors::raise(py, "Error", &error.to_string())
}

/// The exception for a call that failed: the class that a worker gets.
fn of_call(py: Python<'_>, error: &rc_observe::Error) -> PyErr {
    let name = match error {
        rc_observe::Error::Refused { .. } => "Refused",
        rc_observe::Error::Deadline { .. } => "Deadline",
        rc_observe::Error::Unavailable { .. } => "Unavailable",
        rc_observe::Error::NoServer { .. } => "NoServer",
        rc_observe::Error::ServerDied { .. } => "ServerDied",
        rc_observe::Error::Value(_) => "MalformedReply",
        _ => "CallError",
    };
    let raised = errors::raise(py, name, &error.to_string());
    if let rc_observe::Error::Unavailable { state, .. } = error {
        // Without the attribute, the message still has the state.
        let _ = raised.value(py).setattr("state", state);
    }
    raised
}

type Sample = Result<Value, String>;

/// Receives samples until nobody takes them.
fn listen(
    network: &rc_observe::Network,
    topic: &Topic,
    opened: &SyncSender<Result<(), String>>,
    samples: &SyncSender<Sample>,
    ends: &AtomicBool,
) {
    let mut observer = match Observer::new(network) {
        Ok(observer) => observer,
        Err(error) => {
            // The other side waits for it.
            let _ = opened.send(Err(error.to_string()));
            return;
        }
    };
    let outcome = observer.open(topic);
    let is_open = outcome.is_ok();
    let _ = opened.send(outcome.map(drop).map_err(|error| error.to_string()));
    let mut taken = is_open;
    while taken && !ends.load(Ordering::Relaxed) {
        let more = observer.take(&mut |_, observed| {
            let sample = topic.decode(&observed).map_err(|error| error.to_string());
            taken &= samples.send(sample).is_ok();
        });
        if !more {
            observer.wait(&[], TURN);
        }
    }
}

/// The samples of a topic.
#[pyclass(frozen, module = "robocomp._native")]
pub(crate) struct Samples {
    queue: Mutex<Receiver<Sample>>,
    types: Arc<Types>,
    /// Whether nobody listens any more.
    ends: Arc<AtomicBool>,
}

impl Drop for Samples {
    fn drop(&mut self) {
        self.ends.store(true, Ordering::Relaxed);
    }
}

#[pymethods]
impl Samples {
    /// The parameters of the next sample; `None` if none comes within `limit` seconds.
    fn next<'py>(
        &self,
        py: Python<'py>,
        limit: Option<f64>,
    ) -> PyResult<Option<Bound<'py, PyTuple>>> {
        let limit = limit.map(|limit| Duration::try_from_secs_f64(limit).unwrap_or(Duration::MAX));
        let begun = Instant::now();
        loop {
            let left = limit.map_or(TURN, |limit| {
                limit.saturating_sub(begun.elapsed()).min(TURN)
            });
            let found = py.detach(|| {
                let samples = self.queue.lock().unwrap_or_else(PoisonError::into_inner);
                samples.recv_timeout(left)
            });
            match found {
                Ok(Ok(Value::Struct(_, values))) => {
                    return self.types.parts(py, values).map(Some);
                }
                Ok(Ok(_)) => {}
                Ok(Err(reason)) => return Err(errors::raise(py, "Error", &reason)),
                Err(RecvTimeoutError::Disconnected) => return Ok(None),
                Err(RecvTimeoutError::Timeout) => {
                    py.check_signals()?;
                    if limit.is_some_and(|limit| begun.elapsed() >= limit) {
                        return Ok(None);
                    }
                }
            }
        }
    }
}
