//! Topics: publishers and subscribers.

use crate::hub::{self, Table, lock};
use rc_middleware::{
    Durability, Endpoint, Environment, Header, OpenError, Publisher, ReceiveError, SendError,
    Subscriber, WakeEvent,
};
use std::collections::VecDeque;
use std::os::fd::{AsFd, BorrowedFd};
use std::sync::{Arc, LazyLock, Mutex};

static TOPICS: LazyLock<Mutex<Table<State>>> = LazyLock::new(Mutex::default);

/// The publishers and subscribers of a topic.
#[derive(Default)]
pub(crate) struct State {
    publishers: Vec<Arc<Queue>>,
    subscribers: Vec<Arc<Queue>>,
}

/// The last samples, up to a depth: those that a subscriber has not received, or that a publisher
/// keeps for late subscribers.
struct Queue {
    values: Mutex<VecDeque<Value>>,
    depth: usize,
    signal: WakeEvent,
}

type Value = (Header, Arc<[u8]>);

impl Queue {
    fn new(depth: usize, signal: WakeEvent) -> Arc<Self> {
        Arc::new(Self {
            values: Mutex::default(),
            depth,
            signal,
        })
    }

    fn push(&self, value: Value) {
        if self.depth == 0 {
            return;
        }
        let mut values = lock(&self.values);
        if values.len() == self.depth {
            values.pop_front();
        }
        values.push_back(value);
        drop(values);
        self.signal.wake();
    }
}

fn depth(endpoint: &Endpoint) -> usize {
    (endpoint.qos.depth as usize).max(1)
}

fn is_late(endpoint: &Endpoint) -> bool {
    endpoint.qos.durability == Durability::TransientLocal
}

/// Opens a publisher.
pub(crate) fn publisher(
    environment: &Environment,
    endpoint: &Endpoint,
) -> Result<LocalPublisher, OpenError> {
    let state = hub::meet(&TOPICS, environment, endpoint)?;
    let keeps = if is_late(endpoint) {
        depth(endpoint)
    } else {
        0
    };
    let kept = Queue::new(keeps, hub::signal(endpoint)?);
    lock(&state).publishers.push(Arc::clone(&kept));
    let sender = hub::number().into();
    Ok(LocalPublisher {
        state,
        kept,
        sender,
    })
}

/// Opens a subscriber.
pub(crate) fn subscriber(
    environment: &Environment,
    endpoint: &Endpoint,
) -> Result<LocalSubscriber, OpenError> {
    let state = hub::meet(&TOPICS, environment, endpoint)?;
    let queue = Queue::new(depth(endpoint), hub::signal(endpoint)?);
    let mut guard = lock(&state);
    if is_late(endpoint) {
        for publisher in &guard.publishers {
            for value in lock(&publisher.values).iter() {
                queue.push(value.clone());
            }
        }
    }
    guard.subscribers.push(Arc::clone(&queue));
    drop(guard);
    Ok(LocalSubscriber { state, queue })
}

/// A publisher.
pub(crate) struct LocalPublisher {
    state: Arc<Mutex<State>>,
    kept: Arc<Queue>,
    sender: u128,
}

impl Publisher for LocalPublisher {
    fn publish(&mut self, header: Header, body: &[u8]) -> Result<(), SendError> {
        let sender = self.sender;
        let value: Value = (Header { sender, ..header }, Arc::from(body));
        // One lock for both steps: a late subscriber gets each sample once.
        let state = lock(&self.state);
        self.kept.push(value.clone());
        for subscriber in &state.subscribers {
            subscriber.push(value.clone());
        }
        Ok(())
    }

    fn peers(&self) -> usize {
        lock(&self.state).subscribers.len()
    }
}

impl Drop for LocalPublisher {
    fn drop(&mut self) {
        lock(&self.state)
            .publishers
            .retain(|other| !Arc::ptr_eq(other, &self.kept));
    }
}

/// A subscriber.
pub(crate) struct LocalSubscriber {
    state: Arc<Mutex<State>>,
    queue: Arc<Queue>,
}

impl Subscriber for LocalSubscriber {
    fn descriptor(&self) -> BorrowedFd<'_> {
        self.queue.signal.as_fd()
    }

    fn acknowledge(&mut self, _woken: bool) {
        self.queue.signal.clear();
    }

    fn receive(&mut self, take: &mut dyn FnMut(Header, &[u8])) -> Result<bool, ReceiveError> {
        let value = lock(&self.queue.values).pop_front();
        let Some((header, body)) = value else {
            return Ok(false);
        };
        take(header, &body);
        Ok(true)
    }

    fn peers(&self) -> usize {
        lock(&self.state).publishers.len()
    }
}

impl Drop for LocalSubscriber {
    fn drop(&mut self) {
        lock(&self.state)
            .subscribers
            .retain(|other| !Arc::ptr_eq(other, &self.queue));
    }
}
