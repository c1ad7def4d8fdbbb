//! The parameters of a component for its backends. Like requests over the socket, their requests
//! are answered on the management thread.

use crate::parameter_server::{ParameterServer, Requester};
use crate::parameter_values::{json, shown};
use crate::waker::Waker;
use rc_configuration::LiveParameter;
use rc_management::rpc::Error;
use rc_middleware::parameters::{Parameter, ParameterListener, ParameterService, ParameterValue};
use serde_json::{Map, Value};
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{RecvTimeoutError, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// The limit for an answer: longer than a change may wait for the worker.
const LIMIT: Duration = Duration::from_secs(4);
/// The most changes that the worker has requested and that have not ended.
const MOST_OWN: usize = 64;

/// A request, and where its answer goes.
enum BackendRequest {
    List(SyncSender<Vec<LiveParameter>>),
    Set(Map<String, Value>, SyncSender<Result<(), Error>>),
    Subscribe(ParameterListener),
    /// Of the worker itself: a path and a value.
    Own(String, Value),
}

/// The management thread's side. It answers at once, or when the worker has decided.
pub(crate) struct BackendRequests {
    queue: Arc<RequestQueue>,
    /// Where the answers of changes go, by the number of the request.
    pending: BTreeMap<u64, SyncSender<Result<(), Error>>>,
    changes: u64,
}

impl BackendRequests {
    pub(crate) fn new(queue: Arc<RequestQueue>) -> Self {
        Self {
            queue,
            pending: BTreeMap::new(),
            changes: 0,
        }
    }

    /// Serves the queued requests.
    pub(crate) fn turn(&mut self, parameters: &mut ParameterServer) {
        for request in self.queue.take() {
            match request {
                // A requester that no longer waits needs no answer.
                BackendRequest::List(answer) => drop(answer.try_send(parameters.all())),
                BackendRequest::Set(changes, answer) => {
                    self.changes += 1;
                    self.pending.insert(self.changes, answer);
                    parameters.change(Requester::Backend(self.changes), changes);
                }
                BackendRequest::Subscribe(listener) => parameters.subscribe(listener),
                BackendRequest::Own(path, value) => {
                    let changes = Map::from_iter([(path.clone(), value)]);
                    parameters.change(Requester::Worker(path), changes);
                }
            }
        }
    }

    /// Answers the change with this number.
    pub(crate) fn answer(&mut self, number: u64, result: Result<(), Error>) {
        if let Some(answer) = self.pending.remove(&number) {
            let _ = answer.try_send(result);
        }
    }

    /// A change that the worker has requested was made or refused.
    pub(crate) fn own_change_ended(&self) {
        self.queue.own.fetch_sub(1, Ordering::Release);
    }

    /// Refuses requests from now on: the component ends.
    pub(crate) fn end(&self) {
        self.queue.close();
    }
}

/// The requests that wait for the management thread.
pub(crate) struct RequestQueue {
    /// None when the component ends.
    requests: Mutex<Option<Vec<BackendRequest>>>,
    /// How many changes the worker has requested that have not ended.
    own: AtomicUsize,
    management: Waker,
}

impl RequestQueue {
    pub(crate) fn new(management: Waker) -> Self {
        Self {
            requests: Mutex::new(Some(Vec::new())),
            own: AtomicUsize::new(0),
            management,
        }
    }

    fn requests(&self) -> MutexGuard<'_, Option<Vec<BackendRequest>>> {
        self.requests.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn take(&self) -> Vec<BackendRequest> {
        self.requests()
            .as_mut()
            .map(std::mem::take)
            .unwrap_or_default()
    }

    /// Drops all requests, which ends the wait for their answers.
    fn close(&self) {
        let dropped = self.requests().take().unwrap_or_default();
        let own = dropped
            .iter()
            .filter(|r| matches!(r, BackendRequest::Own(..)));
        self.own.fetch_sub(own.count(), Ordering::Release);
    }

    /// Gives a request to the management thread; false when the component ends.
    fn push(&self, request: BackendRequest) -> bool {
        match &mut *self.requests() {
            Some(requests) => requests.push(request),
            None => return false,
        }
        self.management.wake();
        true
    }

    /// Requests a change for the worker, whose thread waits for nothing.
    ///
    /// # Errors
    /// Too many changes of the worker wait.
    pub(crate) fn request_own(&self, path: &str, value: Value) -> Result<(), String> {
        // A component that ends changes nothing, so nothing waits.
        if let Some(requests) = &mut *self.requests() {
            // Only the worker adds some.
            if self.own.load(Ordering::Relaxed) >= MOST_OWN {
                return Err(format!("{MOST_OWN} changes of this worker wait already"));
            }
            self.own.fetch_add(1, Ordering::Relaxed);
            requests.push(BackendRequest::Own(path.to_owned(), value));
            self.management.wake();
        }
        Ok(())
    }

    /// Whether a change of the worker was neither made nor refused.
    pub(crate) fn has_own(&self) -> bool {
        self.own.load(Ordering::Acquire) > 0
    }

    fn call<T>(&self, request: impl FnOnce(SyncSender<T>) -> BackendRequest) -> Result<T, String> {
        let (answer, answered) = sync_channel(1);
        let ends = "the component ends";
        if !self.push(request(answer)) {
            return Err(ends.to_owned());
        }
        answered.recv_timeout(LIMIT).map_err(|error| match error {
            RecvTimeoutError::Disconnected => ends.to_owned(),
            RecvTimeoutError::Timeout => {
                format!("the component has not answered within {LIMIT:?}")
            }
        })
    }
}

impl ParameterService for RequestQueue {
    fn list(&self) -> Result<Vec<Parameter>, String> {
        Ok(shown(&self.call(BackendRequest::List)?))
    }

    fn set(&self, changes: &[(String, ParameterValue)]) -> Result<(), String> {
        let secret = self.call(BackendRequest::List)?;
        let secret = secret.iter().filter(|parameter| parameter.status.secret);
        let secret: Vec<&str> = secret.map(|secret| secret.status.path.as_str()).collect();
        let mut values = Map::new();
        for (path, value) in changes {
            if secret.contains(&path.as_str()) {
                return Err(format!(
                    "`{path}` is secret; change it in the configuration or with `rcdeploy params`"
                ));
            }
            if values.insert(path.clone(), json(value)).is_some() {
                return Err(format!("`{path}` is changed twice; give it one value"));
            }
        }
        if values.is_empty() {
            return Ok(());
        }
        let result = self.call(|answer| BackendRequest::Set(values, answer))?;
        result.map_err(|error| error.message)
    }

    fn watch(&self, listener: ParameterListener) {
        // A component that ends has nothing to tell.
        self.push(BackendRequest::Subscribe(listener));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::waker::waker;

    #[test]
    fn own_changes_of_a_component_that_ends_do_not_wait() {
        let (waker, _wakeups) = waker().expect("a pair");
        let queue = RequestQueue::new(waker);
        for _ in 0..MOST_OWN {
            queue.request_own("speed", 1.into()).expect("room");
        }
        queue.request_own("speed", 1.into()).expect_err("no room");
        queue.close();
        assert!(!queue.has_own());
        for _ in 0..=MOST_OWN {
            queue.request_own("speed", 1.into()).expect("it ends");
        }
        assert!(!queue.has_own());
    }
}
