//! The subscriber of a topic.

use crate::endpoint_state::{Inbox, Reasons, Sender};
use crate::held::Held;
use crate::names;
use crate::qos;
use crate::session::{EndpointSpec, Port, Session, signal};
use crate::wire::Sample;
use rc_middleware::{Endpoint, Header, OpenError, ReceiveError, Subscriber, Unread};
use rc_network::{Backlog, DuplicateFilter, EndpointKind, Role, SampleQueue};
use std::os::fd::{AsFd, BorrowedFd};
use std::rc::Rc;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// The samples of a topic, and what could not be read.
struct Received {
    samples: SampleQueue<Sample>,
    reasons: Reasons,
    /// Whether the subscriber holds samples of unknown writers.
    holds: AtomicBool,
}

impl Backlog for Received {
    fn awaits_peers(&self) -> bool {
        self.holds.load(Ordering::SeqCst)
    }
}

impl Inbox for Received {
    fn put(&self, samples: Vec<Sample>) {
        for sample in samples {
            self.samples.put(sample);
        }
    }

    fn unreadable(&self, reason: String) {
        self.reasons.put(reason);
    }
}

pub(crate) fn open(session: &Rc<Session>, endpoint: &Endpoint) -> Result<RosSubscriber, OpenError> {
    let address = endpoint.address.to_string();
    let received = Arc::new(Received {
        samples: SampleQueue::new(endpoint.qos.depth),
        reasons: Reasons::default(),
        holds: AtomicBool::new(false),
    });
    let port = session.end(EndpointSpec {
        address: &address,
        topic: names::topic(endpoint, session.rules())?,
        role: Role::Subscriber,
        types: &endpoint.types,
        kind: EndpointKind::Reader,
        qos: qos::topic(&endpoint.qos),
        signal: signal(&address)?,
        is_watched: false,
        inbox: Arc::clone(&received) as _,
        group: Default::default(),
    })?;
    Ok(RosSubscriber {
        port,
        received,
        held: Held::new(endpoint.qos.depth),
        duplicates: DuplicateFilter::default(),
        unread: Unread::default(),
        address,
    })
}

pub(crate) struct RosSubscriber {
    port: Port,
    received: Arc<Received>,
    held: Held<Sample>,
    duplicates: DuplicateFilter,
    unread: Unread,
    address: String,
}

impl RosSubscriber {
    /// The oldest sample whose writer is known, or was unknown for too long.
    fn next(&mut self) -> Option<Sample> {
        let state = &self.port.state;
        let is_known = |sample: &Sample| state.sender(&sample.writer) != Sender::Unknown;
        let mut sample = self.held.take(is_known);
        while sample.is_none()
            && let Some(next) = next_of(&self.received, || state.hear())
        {
            // The samples of one writer keep their order.
            let waits = self.held.has(|other| other.writer == next.writer);
            if is_known(&next) && !waits {
                sample = Some(next);
                break;
            }
            self.held.put(next);
            if !self.received.holds.swap(true, Ordering::SeqCst) {
                self.port.session.shared.search_soon();
            }
        }
        // A writer that was found just now wakes nobody.
        let sample = sample.or_else(|| self.held.take(is_known));
        if self.held.is_empty() {
            self.received.holds.store(false, Ordering::SeqCst);
        }
        sample
    }

    fn failed(&self, reason: String) -> ReceiveError {
        ReceiveError {
            address: self.address.clone(),
            reason,
        }
    }
}

/// The oldest sample that was received; `hear` takes in what has arrived.
fn next_of(received: &Received, hear: impl FnOnce() -> bool) -> Option<Sample> {
    received.samples.next().or_else(|| {
        hear();
        received.samples.next()
    })
}

impl Subscriber for RosSubscriber {
    fn descriptor(&self) -> BorrowedFd<'_> {
        self.port.state.signal.as_fd()
    }

    fn acknowledge(&mut self, _woken: bool) {
        self.port.state.signal.clear();
    }

    fn receive(&mut self, take: &mut dyn FnMut(Header, &[u8])) -> Result<bool, ReceiveError> {
        if let Some(reason) = self.received.reasons.next() {
            return Err(self.failed(reason));
        }
        while let Some(sample) = self.next() {
            let type_hash = match self.port.state.sender(&sample.writer) {
                // Discovery has reported a sender of other types.
                Sender::Mismatched => continue,
                Sender::Known(type_hash) => type_hash,
                Sender::Unknown => 0,
            };
            let contract = &self.port.state.identity.contract;
            if !contract.transient_local && self.port.state.is_old(&sample) {
                continue;
            }
            let sender = u128::from_be_bytes(sample.writer);
            if !self.duplicates.is_new(sender, sample.sequence) {
                continue;
            }
            return match sample.taken.body() {
                Ok(body) => {
                    let (sequence, stamp) = (sample.sequence, sample.stamp);
                    let mut header = rc_network::header(sequence, stamp, sender, type_hash);
                    self.unread.renumber(&mut header);
                    take(header, body);
                    Ok(true)
                }
                Err(reason) => {
                    self.unread.note(sender);
                    Err(self.failed(reason))
                }
            };
        }
        Ok(false)
    }

    fn peers(&self) -> usize {
        self.port.state.count()
    }
}
