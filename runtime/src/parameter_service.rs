//! The parameters of a component for its backends: what they ask is answered on the management thread, as what comes over the
//! socket is.

use crate::parameters::{ParameterServer, Refusal, Requester};
use rc_configuration::ParameterStatus;
use rc_configuration::model::{Type, Value as Given};
use rc_middleware::parameters::{Parameter, ParameterListener, ParameterService, ParameterValue};
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;
use std::io::Write;
use std::os::unix::net::UnixStream;
use std::sync::mpsc::{SyncSender, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Longer than a change may wait for the worker.
const LIMIT: Duration = Duration::from_secs(4);
/// The one that this module is among those who ask; callers are counted from 1, and the supervisor is 0.
pub(crate) const BACKENDS: u64 = u64::MAX;

/// What is asked, and where the answer goes.
enum BackendRequest {
    List(SyncSender<Vec<ParameterStatus>>),
    Set(Map<String, Value>, SyncSender<Result<Value, Refusal>>),
    Subscribe(ParameterListener),
}

/// The management thread's side: it answers at once, or when the worker has decided.
pub(crate) struct BackendRequests {
    queue: Arc<RequestQueue>,
    /// Who waits for the worker, by the number of the request.
    waiting: BTreeMap<u64, SyncSender<Result<Value, Refusal>>>,
    /// How many have waited.
    asked: u64,
}

impl BackendRequests {
    pub(crate) fn new(queue: Arc<RequestQueue>) -> Self {
        Self {
            queue,
            waiting: BTreeMap::new(),
            asked: 0,
        }
    }

    /// Takes what was asked.
    pub(crate) fn turn(&mut self, parameters: &mut ParameterServer) {
        for request in self.queue.take() {
            match request {
                // Who does not wait any more has what it needs.
                BackendRequest::List(answer) => drop(answer.try_send(parameters.all())),
                BackendRequest::Set(changes, answer) => {
                    self.asked += 1;
                    self.waiting.insert(self.asked, answer);
                    let requester = Requester {
                        client: BACKENDS,
                        id: Some(self.asked.into()),
                    };
                    parameters.change(requester, changes);
                }
                BackendRequest::Subscribe(listener) => parameters.subscribe(listener),
            }
        }
    }

    /// Hands on what became of the request with this number.
    pub(crate) fn answer(&mut self, id: &Value, result: Result<Value, Refusal>) {
        let waiting = id.as_u64().and_then(|id| self.waiting.remove(&id));
        if let Some(answer) = waiting {
            let _ = answer.try_send(result);
        }
    }

    /// Who asks now is told that the component ends.
    pub(crate) fn end(&self) {
        self.queue.close();
    }
}

/// What waits for the management thread.
pub(crate) struct RequestQueue {
    /// None when the component ends.
    waiting: Mutex<Option<Vec<BackendRequest>>>,
    /// Wakes the management thread.
    end: Arc<UnixStream>,
}

impl RequestQueue {
    pub(crate) fn new(end: Arc<UnixStream>) -> Self {
        Self {
            waiting: Mutex::new(Some(Vec::new())),
            end,
        }
    }

    fn waiting(&self) -> MutexGuard<'_, Option<Vec<BackendRequest>>> {
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes what was asked.
    fn take(&self) -> Vec<BackendRequest> {
        self.waiting()
            .as_mut()
            .map(std::mem::take)
            .unwrap_or_default()
    }

    /// Who asks now, or waits, is told that the component ends.
    fn close(&self) {
        *self.waiting() = None;
    }

    /// Gives a request to the management thread; false when the component ends.
    fn put(&self, request: BackendRequest) -> bool {
        match &mut *self.waiting() {
            Some(waiting) => waiting.push(request),
            None => return false,
        }
        let _ = (&*self.end).write_all(b"p");
        true
    }

    fn ask<T>(&self, request: impl FnOnce(SyncSender<T>) -> BackendRequest) -> Result<T, String> {
        let (answer, answered) = sync_channel(1);
        let ends = "the component ends";
        if !self.put(request(answer)) {
            return Err(ends.to_owned());
        }
        answered.recv_timeout(LIMIT).map_err(|error| match error {
            std::sync::mpsc::RecvTimeoutError::Disconnected => ends.to_owned(),
            std::sync::mpsc::RecvTimeoutError::Timeout => {
                format!("the component has not answered within {LIMIT:?}")
            }
        })
    }
}

impl ParameterService for RequestQueue {
    fn list(&self) -> Result<Vec<Parameter>, String> {
        Ok(shown(&self.ask(BackendRequest::List)?))
    }

    fn set(&self, changes: &[(String, ParameterValue)]) -> Result<(), String> {
        let secret = self.ask(BackendRequest::List)?;
        let secret = secret.iter().filter(|status| status.secret);
        let secret: Vec<&str> = secret.map(|status| status.path.as_str()).collect();
        let mut wanted = Map::new();
        for (path, value) in changes {
            if secret.contains(&path.as_str()) {
                return Err(format!(
                    "`{path}` is secret, and is not told or changed here"
                ));
            }
            if wanted.insert(path.clone(), json(value)).is_some() {
                return Err(format!("`{path}` is changed twice; give it one value"));
            }
        }
        if wanted.is_empty() {
            return Ok(());
        }
        let answer = self.ask(|answer| BackendRequest::Set(wanted, answer))?;
        answer.map(drop).map_err(|refusal| refusal.message)
    }

    fn watch(&self, listener: ParameterListener) {
        // Of a component that ends there is nothing to tell.
        self.put(BackendRequest::Subscribe(listener));
    }
}

/// What backends may know.
pub(crate) fn shown(all: &[ParameterStatus]) -> Vec<Parameter> {
    let shown = all.iter().filter(|status| !status.secret);
    shown.map(parameter).collect()
}

fn parameter(status: &ParameterStatus) -> Parameter {
    let limit = |limit: Option<&Given>, otherwise: ParameterValue| match limit {
        Some(Given::Int(number)) => ParameterValue::Int(*number),
        Some(Given::Float(number)) => ParameterValue::Float(*number),
        _ => otherwise,
    };
    let range = status.range.as_ref().and_then(|range| {
        let (least, most) = match status.ty? {
            (Type::Int, _) => (
                ParameterValue::Int(i32::MIN.into()),
                ParameterValue::Int(i32::MAX.into()),
            ),
            (Type::Long, _) => (ParameterValue::Int(i64::MIN), ParameterValue::Int(i64::MAX)),
            (Type::Float | Type::Double, _) => (
                ParameterValue::Float(f64::NEG_INFINITY),
                ParameterValue::Float(f64::INFINITY),
            ),
            _ => return None,
        };
        Some((
            limit(range.min.as_ref(), least),
            limit(range.max.as_ref(), most),
        ))
    });
    Parameter {
        path: status.path.clone(),
        value: value(status),
        doc: status.doc.join("\n"),
        allowed: status.allowed.clone(),
        editable: status.editable || status.restart,
        range,
    }
}

/// A number, also one that JSON has no numbers for.
fn float(value: &Value) -> Option<f64> {
    value
        .as_f64()
        .or_else(|| value.as_str().and_then(|text| text.parse().ok()))
}

fn value(status: &ParameterStatus) -> ParameterValue {
    let value = &status.value;
    let text = |value: &Value| value.as_str().map(str::to_owned);
    let Some((ty, is_array)) = status.ty else {
        return ParameterValue::None;
    };
    let items = value.as_array().filter(|_| is_array);
    let Some(items) = items else {
        return match ty {
            Type::Bool => value.as_bool().map(ParameterValue::Bool),
            Type::Int | Type::Long => value.as_i64().map(ParameterValue::Int),
            Type::Float | Type::Double => float(value).map(ParameterValue::Float),
            Type::String | Type::Duration | Type::Path => text(value).map(ParameterValue::Text),
        }
        .unwrap_or(ParameterValue::None);
    };
    let items = items.iter();
    match ty {
        Type::Bool => ParameterValue::Bools(items.filter_map(Value::as_bool).collect()),
        Type::Int | Type::Long => ParameterValue::Ints(items.filter_map(Value::as_i64).collect()),
        Type::Float | Type::Double => ParameterValue::Floats(items.filter_map(float).collect()),
        Type::String | Type::Duration | Type::Path => {
            ParameterValue::Texts(items.filter_map(text).collect())
        }
    }
}

/// As the checker takes it.
fn json(value: &ParameterValue) -> Value {
    let float = |number: f64| match serde_json::Number::from_f64(number) {
        Some(number) => Value::Number(number),
        None if number.is_nan() => json!("nan"),
        None if number > 0.0 => json!("inf"),
        None => json!("-inf"),
    };
    match value {
        ParameterValue::None => Value::Null,
        ParameterValue::Bool(value) => json!(value),
        ParameterValue::Int(value) => json!(value),
        ParameterValue::Float(value) => float(*value),
        ParameterValue::Text(value) => json!(value),
        ParameterValue::Bools(values) => json!(values),
        ParameterValue::Ints(values) => json!(values),
        ParameterValue::Floats(values) => values.iter().copied().map(float).collect(),
        ParameterValue::Texts(values) => json!(values),
    }
}
