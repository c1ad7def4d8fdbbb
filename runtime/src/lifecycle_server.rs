//! Requests over the management socket for transitions of the life cycle. The worker takes a
//! transition; the requester gets the result, within a limit.

use crate::lifecycle::{LIMIT, Lifecycle, Transition, too_late};
use crate::waker::Waker;
use rc_lifecycle::LifecycleState;
use rc_management::component;
use rc_management::rpc::{self, Error};
use serde_json::Value;
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// A client that waits for a result.
struct Requester {
    client: u64,
    id: Option<Value>,
    transition: Transition,
    until: Instant,
}

/// A client, the identifier of its request, and the result.
type Answer = (u64, Option<Value>, Result<Value, Error>);

/// The results that the worker's thread hands over, by the number of the request.
type Results = Vec<(u64, Result<LifecycleState, String>)>;

/// The requests for transitions, on the management thread.
pub(crate) struct LifecycleServer {
    lifecycle: Option<Arc<Lifecycle>>,
    management: Waker,
    requests: u64,
    waiting: BTreeMap<u64, Requester>,
    results: Arc<Mutex<Results>>,
}

impl LifecycleServer {
    pub(crate) fn new(lifecycle: Option<Arc<Lifecycle>>, management: Waker) -> Self {
        Self {
            lifecycle,
            management,
            requests: 0,
            waiting: BTreeMap::new(),
            results: Arc::default(),
        }
    }

    /// Begins a request. [`LifecycleServer::turn`] returns its result.
    pub(crate) fn begin(
        &mut self,
        client: u64,
        id: Option<Value>,
        transition: Transition,
    ) -> Result<(), Error> {
        let Some(lifecycle) = &self.lifecycle else {
            let text = "this component is not managed; write `lifecycle managed;` in its .cdsl and generate it again";
            return Err(Error::new(Error::INVALID_PARAMS, text));
        };
        self.requests += 1;
        let number = self.requests;
        let (results, management) = (Arc::clone(&self.results), self.management.clone());
        let done = move |result| {
            let mut results = results.lock().unwrap_or_else(PoisonError::into_inner);
            results.push((number, result));
            drop(results);
            management.wake();
        };
        let until = Instant::now() + LIMIT;
        let refused = lifecycle.request(transition, until, Box::new(done));
        refused.map_err(|reason| Error::new(Error::WORKER_REFUSES, reason))?;
        let requester = Requester {
            client,
            id,
            transition,
            until,
        };
        self.waiting.insert(number, requester);
        Ok(())
    }

    /// The results that are due.
    pub(crate) fn turn(&mut self) -> Vec<Answer> {
        let mut answers = Vec::new();
        let results = {
            let mut results = self.results.lock().unwrap_or_else(PoisonError::into_inner);
            std::mem::take(&mut *results)
        };
        for (number, result) in results {
            if let Some(requester) = self.waiting.remove(&number) {
                let result = match result {
                    Ok(state) => rpc::result(&component::Lifecycle { state }),
                    Err(reason) => Err(Error::new(Error::WORKER_REFUSES, reason)),
                };
                answers.push((requester.client, requester.id, result));
            }
        }
        let now = Instant::now();
        for (_, late) in self.waiting.extract_if(.., |_, waits| now >= waits.until) {
            let state = self.lifecycle.as_ref().map(|lifecycle| lifecycle.state());
            let state = state.unwrap_or(LifecycleState::Unconfigured);
            let error = Error::new(Error::WORKER_TIMEOUT, too_late(late.transition, state));
            answers.push((late.client, late.id, Err(error)));
        }
        answers
    }

    /// How long until a requester has waited for too long.
    pub(crate) fn time_left(&self) -> Option<Duration> {
        let until = self.waiting.values().map(|waits| waits.until).min()?;
        Some(until.saturating_duration_since(Instant::now()))
    }
}
