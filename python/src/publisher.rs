//! A topic to which a program without a component publishes. Its endpoint lives on a thread of its
//! own, as those of all middlewares.

use crate::errors;
use crate::types::Types;
use crate::waiting::awaited;
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use rc_observe::{Sender, Topic};
use rc_values::{Struct, Value};
use std::sync::mpsc::{self, Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;

/// The requests to the thread.
enum Request {
    Send(Value, SyncSender<Result<(), String>>),
    Count(SyncSender<usize>),
}

/// The thread of the endpoint.
struct Endpoint {
    requests: mpsc::Sender<Request>,
    thread: JoinHandle<()>,
}

/// Sends samples to a topic.
#[pyclass(frozen, module = "robocomp._native")]
pub(crate) struct Publisher {
    endpoint: Mutex<Option<Endpoint>>,
    types: Arc<Types>,
    operation: String,
    request: Arc<Struct>,
}

/// Serves requests until no sender is left, then waits for the last samples.
fn serve(
    network: &rc_observe::Network,
    topic: &Topic,
    opened: &SyncSender<Result<(), String>>,
    requests: &Receiver<Request>,
) {
    let mut sender = match Sender::open(network, topic) {
        Ok(sender) => sender,
        Err(error) => {
            // The requester may have stopped waiting, as for all replies here.
            let _ = opened.send(Err(error.to_string()));
            return;
        }
    };
    let _ = opened.send(Ok(()));
    for request in requests {
        match request {
            Request::Send(sample, done) => {
                let sent = sender.send(&sample);
                let _ = done.send(sent.map_err(|error| error.to_string()));
            }
            Request::Count(done) => {
                let _ = done.send(sender.subscribers());
            }
        }
    }
    sender.finish();
}

impl Publisher {
    pub(crate) fn open(
        py: Python<'_>,
        network: rc_observe::Network,
        topic: Topic,
        types: Arc<Types>,
    ) -> PyResult<Self> {
        let (operation, request) = (
            topic.operation.name.clone(),
            Arc::clone(&topic.operation.request),
        );
        let (opened, opens) = sync_channel(1);
        let (requests, asked) = mpsc::channel();
        let thread = std::thread::Builder::new().name("publisher".to_owned());
        let thread = thread.spawn(move || serve(&network, &topic, &opened, &asked))?;
        let outcome = awaited(py, opens)?;
        let outcome = outcome.unwrap_or_else(|| Err("the thread of the topic ended".to_owned()));
        outcome.map_err(|reason| errors::raise(py, "Error", &reason))?;
        Ok(Self {
            endpoint: Mutex::new(Some(Endpoint { requests, thread })),
            types,
            operation,
            request,
        })
    }

    /// Asks the thread.
    fn ask<T: Send + 'static>(
        &self,
        py: Python<'_>,
        request: impl FnOnce(SyncSender<T>) -> Request,
    ) -> PyResult<T> {
        let endpoint = self.endpoint.lock().unwrap_or_else(PoisonError::into_inner);
        let requests = endpoint.as_ref().map(|endpoint| endpoint.requests.clone());
        drop(endpoint);
        let closed = || errors::raise(py, "SendError", "the publisher is closed");
        let requests = requests.ok_or_else(closed)?;
        let (done, answers) = sync_channel(1);
        requests.send(request(done)).map_err(|_| closed())?;
        awaited(py, answers)?.ok_or_else(closed)
    }
}

#[pymethods]
impl Publisher {
    /// Sends a sample.
    fn publish(&self, py: Python<'_>, arguments: &Bound<'_, PyTuple>) -> PyResult<()> {
        let sample = self.types.arguments(&self.request, arguments);
        let sample = sample.map_err(|misfit| {
            let message = format!("{}(): {misfit}", self.operation);
            errors::raise(py, "InvalidSample", &message)
        })?;
        let sent = self.ask(py, |done| Request::Send(sample, done))?;
        sent.map_err(|reason| errors::raise(py, "SendError", &reason))
    }

    /// The number of subscribers.
    fn subscribers(&self, py: Python<'_>) -> PyResult<usize> {
        self.ask(py, Request::Count)
    }

    /// Waits until the last samples have arrived, and closes the endpoint.
    fn close(&self, py: Python<'_>) {
        let endpoint = self.endpoint.lock();
        let endpoint = endpoint.unwrap_or_else(PoisonError::into_inner).take();
        if let Some(Endpoint { requests, thread }) = endpoint {
            drop(requests);
            // A panic of the thread was printed.
            py.detach(|| drop(thread.join()));
        }
    }
}
