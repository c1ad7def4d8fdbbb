//! Topics: publishers and subscribers.

use crate::body::{Body, Pool};
use crate::hub::{self, QUEUE_LIMIT, Table, lock};
use rc_middleware::{
    Durability, Encoding, Endpoint, Environment, Header, KEPT_SAMPLES, KeptSample, LoanedSample,
    Message, OpenError, Publisher, QueueGauge, ReceiveError, SendError, SharedValue, Subscriber,
    WakeEvent,
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
    samples: Mutex<VecDeque<Sample>>,
    depth: usize,
    gauge: QueueGauge,
    signal: WakeEvent,
}

#[derive(Clone)]
struct Sample {
    header: Header,
    content: Content,
}

/// The body of a sample.
#[derive(Clone)]
enum Content {
    Bytes(Arc<Body>),
    Value(SharedValue),
}

impl Content {
    /// The memory that it takes, in bytes. It stays as it is while the sample waits.
    fn memory(&self) -> usize {
        match self {
            Self::Bytes(body) => body.room(),
            Self::Value(value) => value.memory(),
        }
    }
}

impl Queue {
    fn new(depth: usize, signal: WakeEvent) -> Arc<Self> {
        Arc::new(Self {
            samples: Mutex::default(),
            depth,
            gauge: QueueGauge::new(QUEUE_LIMIT),
            signal,
        })
    }

    /// Adds a sample. A full queue drops its oldest ones; a sample that is larger than the whole
    /// queue is dropped itself.
    fn push(&self, sample: Sample) {
        if self.depth == 0 {
            return;
        }
        let size = sample.content.memory();
        let Some(room) = self.gauge.limit().checked_sub(size as u64) else {
            return self.gauge.drop_one();
        };
        let mut samples = lock(&self.samples);
        while samples.len() >= self.depth || self.gauge.bytes() > room {
            let is_full = samples.len() >= self.depth;
            let Some(oldest) = samples.pop_front() else {
                break;
            };
            self.gauge.remove(oldest.content.memory());
            if !is_full {
                self.gauge.drop_one();
            }
        }
        self.gauge.add(size);
        samples.push_back(sample);
        drop(samples);
        self.signal.wake();
    }

    /// Takes the oldest sample.
    fn next(&self) -> Option<Sample> {
        let sample = lock(&self.samples).pop_front()?;
        self.gauge.remove(sample.content.memory());
        Some(sample)
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
    Ok(LocalPublisher(Arc::new(Outlet {
        address: endpoint.address.to_string(),
        state,
        kept,
        sender: hub::number().into(),
        pool: Mutex::default(),
    })))
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
            for sample in lock(&publisher.samples).iter() {
                queue.push(sample.clone());
            }
        }
    }
    guard.subscribers.push(Arc::clone(&queue));
    drop(guard);
    Ok(LocalSubscriber {
        address: endpoint.address.to_string(),
        state,
        queue,
        kept: Arc::default(),
    })
}

/// A publisher.
pub(crate) struct LocalPublisher(Arc<Outlet>);

/// The state that a publisher and the samples that it lends need to send.
struct Outlet {
    address: String,
    state: Arc<Mutex<State>>,
    kept: Arc<Queue>,
    sender: u128,
    pool: Mutex<Pool>,
}

impl Outlet {
    fn no_memory(&self, length: usize) -> SendError {
        SendError::Backend {
            address: self.address.clone(),
            reason: format!("there is no memory for {length} bytes"),
        }
    }

    /// Hands a body to all subscribers, and keeps it for a later sample.
    fn send(&self, header: Header, body: Arc<Body>) {
        lock(&self.pool).keep(&body);
        self.share(header, Content::Bytes(body));
    }

    /// Hands the body to all subscribers, which share it.
    fn share(&self, header: Header, content: Content) {
        let sender = self.sender;
        let header = Header { sender, ..header };
        let sample = Sample { header, content };
        // One lock for both steps: a late subscriber gets each sample once.
        let state = lock(&self.state);
        self.kept.push(sample.clone());
        // The last one gets the sample itself, so that a value with one receiver is not cloned.
        if let Some((last, others)) = state.subscribers.split_last() {
            for subscriber in others {
                subscriber.push(sample.clone());
            }
            last.push(sample);
        }
    }
}

impl LocalPublisher {
    fn lend(&self, length: usize) -> Result<Box<Lent>, SendError> {
        let outlet = Arc::clone(&self.0);
        let body = lock(&outlet.pool).take(length);
        let body = body.ok_or_else(|| outlet.no_memory(length))?;
        Ok(Box::new(Lent { outlet, body }))
    }
}

impl Publisher for LocalPublisher {
    fn publish(&mut self, header: Header, body: &[u8]) -> Result<(), SendError> {
        let copied = lock(&self.0.pool).copy(body);
        let copied = copied.ok_or_else(|| self.0.no_memory(body.len()))?;
        self.0.send(header, copied);
        Ok(())
    }

    fn takes_values(&self) -> bool {
        true
    }

    fn publish_value(&mut self, header: Header, body: SharedValue) -> Result<(), SendError> {
        self.0.share(header, Content::Value(body));
        Ok(())
    }

    fn can_loan(&self, _encoding: Encoding) -> bool {
        true
    }

    fn loan(&mut self, length: usize) -> Result<Box<dyn LoanedSample + '_>, SendError> {
        Ok(self.lend(length)?)
    }

    fn loan_image(&mut self, length: usize) -> Result<Option<Box<dyn LoanedSample>>, SendError> {
        Ok(Some(self.lend(length)?))
    }

    fn senders(&self) -> Vec<u128> {
        vec![self.0.sender]
    }

    fn peers(&self) -> usize {
        lock(&self.0.state).subscribers.len()
    }
}

/// A sample that is being written.
struct Lent {
    outlet: Arc<Outlet>,
    /// It has no other owner.
    body: Arc<Body>,
}

impl LoanedSample for Lent {
    fn memory(&self) -> &[u8] {
        self.body.bytes()
    }

    fn memory_mut(&mut self) -> &mut [u8] {
        Arc::get_mut(&mut self.body).map_or(&mut [], Body::bytes_mut)
    }

    fn send(self: Box<Self>, header: Header) -> Result<(), SendError> {
        self.outlet.send(header, self.body);
        Ok(())
    }
}

impl Drop for LocalPublisher {
    fn drop(&mut self) {
        lock(&self.0.state)
            .publishers
            .retain(|other| !Arc::ptr_eq(other, &self.0.kept));
    }
}

/// A subscriber.
pub(crate) struct LocalSubscriber {
    address: String,
    state: Arc<Mutex<State>>,
    queue: Arc<Queue>,
    /// Each kept sample has a clone.
    kept: Arc<()>,
}

/// A sample that its receiver keeps.
struct Kept {
    body: KeptBody,
    _counted: Arc<()>,
}

enum KeptBody {
    Shared(Arc<Body>),
    /// The encoding of a value.
    Own(Vec<u8>),
}

impl KeptSample for Kept {
    fn memory(&self) -> &[u8] {
        match &self.body {
            KeptBody::Shared(body) => body.bytes(),
            KeptBody::Own(bytes) => bytes,
        }
    }
}

impl Subscriber for LocalSubscriber {
    fn descriptor(&self) -> BorrowedFd<'_> {
        self.queue.signal.as_fd()
    }

    fn acknowledge(&mut self, _woken: bool) {
        self.queue.signal.clear();
    }

    fn receive(&mut self, take: &mut dyn FnMut(Header, &[u8])) -> Result<bool, ReceiveError> {
        self.receive_message(&mut |header, message| take(header, message.bytes()))
    }

    fn receive_message(
        &mut self,
        take: &mut dyn FnMut(Header, Message<'_>),
    ) -> Result<bool, ReceiveError> {
        let Some(Sample { header, content }) = self.queue.next() else {
            return Ok(false);
        };
        match content {
            Content::Bytes(body) => take(header, Message::Bytes(body.bytes())),
            Content::Value(value) => take(header, Message::Value(value.into())),
        }
        Ok(true)
    }

    fn can_keep(&self) -> bool {
        true
    }

    fn receive_kept(
        &mut self,
        take: &mut dyn FnMut(Header, Box<dyn KeptSample>),
    ) -> Result<bool, ReceiveError> {
        if Arc::strong_count(&self.kept) > KEPT_SAMPLES + 1 {
            return Err(ReceiveError {
                address: self.address.clone(),
                reason: format!("its receiver keeps more than {KEPT_SAMPLES} samples"),
            });
        }
        let Some(Sample { header, content }) = self.queue.next() else {
            return Ok(false);
        };
        let kept = Kept {
            body: match content {
                Content::Bytes(body) => KeptBody::Shared(body),
                Content::Value(value) => KeptBody::Own(value.to_bytes()),
            },
            _counted: Arc::clone(&self.kept),
        };
        take(header, Box::new(kept));
        Ok(true)
    }

    fn peers(&self) -> usize {
        lock(&self.state).publishers.len()
    }

    fn queue(&self) -> Option<QueueGauge> {
        Some(self.queue.gauge.clone())
    }
}

impl Drop for LocalSubscriber {
    fn drop(&mut self) {
        lock(&self.state)
            .subscribers
            .retain(|other| !Arc::ptr_eq(other, &self.queue));
    }
}
