//! The samples of a topic, which a thread receives until the program takes them.

use crate::errors;
use crate::types::Types;
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use rc_observe::{Observer, Topic};
use rc_values::Value;
use std::collections::VecDeque;
use std::sync::mpsc::{SyncSender, sync_channel};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// The most bytes of messages that wait for the program, in addition to the one that it takes next.
/// Their values take more memory if a sequence has structures.
const MOST_BYTES: usize = 64 << 20;
/// The most samples that wait. Small ones have a cost that their bytes do not tell.
const MOST: usize = 1 << 16;
/// The longest wait before signals are handled.
const TURN: Duration = Duration::from_millis(100);

type Sample = Result<Value, String>;

/// Samples that wait for the program.
#[derive(Default)]
struct Queue {
    /// With their size as messages, in bytes.
    samples: VecDeque<(Sample, usize)>,
    bytes: usize,
    dropped: u64,
    /// Whether the reader has stopped.
    ends: bool,
    /// Whether the samples have ended.
    closed: bool,
}

impl Queue {
    fn push(&mut self, sample: Sample, size: usize) {
        self.samples.push_back((sample, size));
        self.bytes += size;
        while self.samples.len() > 1 && (self.bytes > MOST_BYTES || self.samples.len() > MOST) {
            self.pop();
            self.dropped += 1;
        }
    }

    fn pop(&mut self) -> Option<Sample> {
        let (sample, size) = self.samples.pop_front()?;
        self.bytes -= size;
        Some(sample)
    }
}

/// A queue between the thread that receives and the program.
#[derive(Default)]
struct Shared {
    queue: Mutex<Queue>,
    changed: Condvar,
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, Queue> {
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Closes the queue when the thread ends, in whatever way.
struct Closing<'s>(&'s Shared);

impl Drop for Closing<'_> {
    fn drop(&mut self) {
        self.0.lock().closed = true;
        self.0.changed.notify_all();
    }
}

/// Receives samples until the reader stops.
fn listen(
    network: &rc_observe::Network,
    topic: &Topic,
    opened: &SyncSender<Result<(), String>>,
    shared: &Shared,
) {
    let _closing = Closing(shared);
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
    while is_open && !shared.lock().ends {
        let more = observer.take(&mut |_, observed| {
            let sample = topic.decode(&observed).map_err(|error| error.to_string());
            shared.lock().push(sample, observed.body.len());
            shared.changed.notify_all();
        });
        if !more {
            observer.wait(&[], TURN);
        }
    }
}

/// The samples of a topic.
#[pyclass(frozen, module = "robocomp._native")]
pub(crate) struct Samples {
    shared: Arc<Shared>,
    types: Arc<Types>,
}

impl Drop for Samples {
    fn drop(&mut self) {
        self.shared.lock().ends = true;
    }
}

impl Samples {
    /// Listens to a topic, from now on.
    pub(crate) fn of(
        py: Python<'_>,
        network: rc_observe::Network,
        topic: Topic,
        types: Arc<Types>,
    ) -> PyResult<Self> {
        let shared = Arc::new(Shared::default());
        let (opened, opens) = sync_channel(1);
        std::thread::Builder::new()
            .name("topic".to_owned())
            .spawn({
                let shared = Arc::clone(&shared);
                move || listen(&network, &topic, &opened, &shared)
            })?;
        let outcome = py.detach(move || opens.recv());
        let outcome = outcome.unwrap_or_else(|_| Err("the thread of the topic ended".to_owned()));
        outcome.map_err(|reason| errors::raise(py, "Error", &reason))?;
        Ok(Self { shared, types })
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
            let (found, closed) = py.detach(|| {
                let waits = |queue: &mut Queue| queue.samples.is_empty() && !queue.closed;
                let changed = &self.shared.changed;
                let waited = changed.wait_timeout_while(self.shared.lock(), left, waits);
                let (mut queue, _) = waited.unwrap_or_else(PoisonError::into_inner);
                (queue.pop(), queue.closed)
            });
            match found {
                Some(Ok(Value::Struct(_, values))) => {
                    return self.types.parts(py, values).map(Some);
                }
                Some(Ok(_)) => {}
                Some(Err(reason)) => return Err(errors::raise(py, "Error", &reason)),
                None if closed => return Ok(None),
                None => {
                    py.check_signals()?;
                    if limit.is_some_and(|limit| begun.elapsed() >= limit) {
                        return Ok(None);
                    }
                }
            }
        }
    }

    /// The number of samples that were dropped so far because the program was too slow.
    fn dropped(&self) -> u64 {
        self.shared.lock().dropped
    }
}
