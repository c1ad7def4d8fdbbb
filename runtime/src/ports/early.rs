//! Samples that a worker awaits inside of a turn, before the event loop hands them out.
//!
//! A worker that waits for a change of the shared world gets the samples of its topics early. The
//! event loop hands them out again later, where they are counted, copied to tools and recorded as
//! all others: the replica knows them then.

use super::Connections;
use crate::clock::{Clock, Time};
use crate::exact::entry::{Entry, Kind};
use crate::exact::mode::Exact;
use crate::slots::OpenSlot;
use rc_management::component::ClockKind;
use rc_middleware::{
    Endpoint, Header, OpenError, QueueGauge, ReceiveError, Subscriber, WakeEvent, wait,
};
use std::borrow::Cow;
use std::cell::RefCell;
use std::collections::VecDeque;
use std::io;
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::rc::Rc;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// The interfaces whose samples may be awaited, by the names of their types.
const INTERFACES: [&str; 2] = ["RcWorld::World", "RcWorld::WorldStream"];
/// Most bytes that the event loop has not handed out yet.
const MOST_WAITING: usize = 16 << 20;
/// The longest wait without a look at the clock.
const PAUSE: Duration = Duration::from_millis(10);
/// The entry of a wait that is over.
const OVER: u64 = u64::MAX;

impl Connections {
    /// The messages that a worker may await inside of a turn.
    pub fn early_samples(&self) -> &EarlySamples {
        self.early.get_or_init(|| {
            let may_wait = matches!(self.clock, ClockKind::System | ClockKind::Nodes);
            EarlySamples::new(&self.exact, &self.now, may_wait, self.stop.as_ref())
        })
    }

    /// Shares the port of a slot whose samples the worker may await.
    pub(super) fn shared_early(
        &self,
        (slot, operation): (&OpenSlot, usize),
        endpoint: &Endpoint,
        port: Box<dyn Subscriber>,
    ) -> Result<Box<dyn Subscriber>, OpenError> {
        let mut interfaces = INTERFACES.iter();
        let Some(interface) = interfaces.position(|own| *own == slot.type_name) else {
            return Ok(port);
        };
        let of = (interface, operation);
        let shared = self
            .early_samples()
            .share(of, endpoint.types.hash, port)
            .map_err(|error| OpenError::Backend {
                address: endpoint.address.to_string(),
                reason: format!("cannot share its descriptor: {error}"),
            })?;
        Ok(Box::new(shared))
    }
}

/// A port that the event loop and a waiting worker share.
struct SharedPort {
    port: Box<dyn Subscriber>,
    /// The messages that the worker has received, and the event loop has not.
    waiting: VecDeque<(Header, Vec<u8>)>,
    bytes: usize,
}

/// The memory of a waiting sample.
fn size(body: &[u8]) -> usize {
    size_of::<(Header, Vec<u8>)>() + body.len()
}

/// The port, as the event loop has it.
struct EarlyPort {
    descriptor: OwnedFd,
    shared: Rc<RefCell<SharedPort>>,
}

impl Subscriber for EarlyPort {
    fn descriptor(&self) -> BorrowedFd<'_> {
        self.descriptor.as_fd()
    }

    fn acknowledge(&mut self, woken: bool) {
        self.shared.borrow_mut().port.acknowledge(woken);
    }

    fn receive(&mut self, take: &mut dyn FnMut(Header, &[u8])) -> Result<bool, ReceiveError> {
        let mut shared = self.shared.borrow_mut();
        let Some((header, body)) = shared.waiting.pop_front() else {
            return shared.port.receive(take);
        };
        shared.bytes = shared.bytes.saturating_sub(size(&body));
        drop(shared);
        take(header, &body);
        Ok(true)
    }

    fn peers(&self) -> usize {
        self.shared.borrow().port.peers()
    }

    fn queue(&self) -> Option<QueueGauge> {
        self.shared.borrow().port.queue()
    }
}

/// A port, as the waiting worker has it.
struct AwaitedPort {
    /// The number of the interface, and that of the topic.
    of: (usize, usize),
    type_hash: u64,
    descriptor: OwnedFd,
    shared: Rc<RefCell<SharedPort>>,
}

impl AwaitedPort {
    /// Takes a sample. A port that cannot be read says so to the event loop.
    fn receive(&self) -> Option<Vec<u8>> {
        // A handler of this very port does not wait for it.
        let mut shared = self.shared.try_borrow_mut().ok()?;
        let mut came = None;
        let taken = shared.port.receive(&mut |header, body| {
            came = Some((header, body.to_vec()));
        });
        let (header, body) = came.filter(|_| taken.is_ok())?;
        shared.bytes += size(&body);
        shared.waiting.push_back((header, body.clone()));
        let is_of_type = header.type_hash == 0 || header.type_hash == self.type_hash;
        Some(if is_of_type { body } else { Vec::new() })
    }

    fn acknowledge(&self, woken: bool) {
        if let Ok(mut shared) = self.shared.try_borrow_mut() {
            shared.port.acknowledge(woken);
        }
    }

    fn bytes(&self) -> usize {
        self.shared
            .try_borrow()
            .map_or(usize::MAX, |shared| shared.bytes)
    }
}

/// An input while a worker waits.
#[derive(Debug, PartialEq)]
pub struct Awaited {
    /// The time of the network.
    pub now: Time,
    /// A sample: the number of its interface among those that may be awaited, that of its topic,
    /// and its bytes. Without a sample, time has passed.
    pub sample: Option<(usize, usize, Vec<u8>)>,
}

/// Samples of the shared world that a worker awaits.
#[derive(Clone)]
pub struct EarlySamples(Rc<Early>);

struct Early {
    ports: RefCell<Vec<AwaitedPort>>,
    exact: Exact,
    clock: Arc<dyn Clock>,
    /// In simulated time, nothing arrives within a turn.
    may_wait: bool,
    stop: Option<WakeEvent>,
}

impl EarlySamples {
    fn new(
        exact: &Exact,
        clock: &Arc<dyn Clock>,
        may_wait: bool,
        stop: Option<&WakeEvent>,
    ) -> Self {
        Self(Rc::new(Early {
            ports: RefCell::default(),
            exact: exact.clone(),
            clock: Arc::clone(clock),
            may_wait,
            stop: stop.cloned(),
        }))
    }

    /// Shares a port. `of` are the numbers of the interface and the topic.
    fn share(
        &self,
        of: (usize, usize),
        type_hash: u64,
        port: Box<dyn Subscriber>,
    ) -> io::Result<EarlyPort> {
        let descriptor = port.descriptor().try_clone_to_owned()?;
        let for_loop = descriptor.try_clone()?;
        let shared = Rc::new(RefCell::new(SharedPort {
            port,
            waiting: VecDeque::new(),
            bytes: 0,
        }));
        self.0.ports.borrow_mut().push(AwaitedPort {
            of,
            type_hash,
            descriptor,
            shared: Rc::clone(&shared),
        });
        Ok(EarlyPort {
            descriptor: for_loop,
            shared,
        })
    }

    /// The next sample, or the time after a pause. `None` once it is `until`, the component is to
    /// end, too much waits for the event loop, or nothing can arrive. An exact recording keeps it.
    pub fn next(&self, until: Instant) -> Option<Awaited> {
        let early = &*self.0;
        let entry = early.exact.awaited(|| early.entry(until));
        let now = Time::from_nanos(entry.value);
        match entry.type_hash {
            OVER => None,
            0 => Some(Awaited { now, sample: None }),
            code => {
                let at = (code - 1) as usize;
                let sample = Some((at / 256, at % 256, entry.data.into_owned()));
                Some(Awaited { now, sample })
            }
        }
    }
}

impl Early {
    /// The next input as an entry of a recording: the time, and the message.
    fn entry(&self, until: Instant) -> Entry<'static> {
        let (code, data) = self.wait(until);
        Entry {
            value: self.clock.now().as_nanos(),
            type_hash: code,
            data: Cow::Owned(data),
            ..Entry::of(Kind::Awaited)
        }
    }

    fn wait(&self, until: Instant) -> (u64, Vec<u8>) {
        let ports = self.ports.borrow();
        let is_full = ports
            .iter()
            .map(AwaitedPort::bytes)
            .any(|b| b > MOST_WAITING);
        if ports.is_empty() || !self.may_wait || is_full {
            return (OVER, Vec::new());
        }
        // Before anything is read: samples may come faster than they are taken.
        let is_stopping = self.stop.as_ref().is_some_and(WakeEvent::is_stopping);
        let left = until.saturating_duration_since(Instant::now());
        if is_stopping || left.is_zero() {
            return (OVER, Vec::new());
        }
        if let Some(came) = Self::receive(&ports) {
            return came;
        }
        let descriptors: Vec<_> = ports.iter().map(|port| port.descriptor.as_fd()).collect();
        let readable = wait(&descriptors, left.min(PAUSE));
        for (at, port) in ports.iter().enumerate() {
            port.acknowledge(readable & (1 << at) != 0);
        }
        Self::receive(&ports).unwrap_or((0, Vec::new()))
    }

    fn receive(ports: &[AwaitedPort]) -> Option<(u64, Vec<u8>)> {
        ports.iter().find_map(|port| {
            let body = port.receive()?;
            let (interface, topic) = port.of;
            Some(((1 + interface * 256 + topic) as u64, body))
        })
    }
}
