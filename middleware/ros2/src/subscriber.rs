//! The receiving end of a topic.

use crate::endpoint_state::{Inbox, Reasons};
use crate::names;
use crate::qos;
use crate::session::{EndpointSpec, Port, Session, signal};
use crate::wire::Sample;
use rc_middleware::{Endpoint, Header, OpenError, ReceiveError, Subscriber, Unread};
use rc_network::{DuplicateFilter, Role, SampleQueue};
use std::os::fd::{AsFd, BorrowedFd};
use std::rc::Rc;
use std::sync::Arc;

/// The values of a topic, and what could not be read.
struct Heap {
    values: SampleQueue<Sample>,
    reasons: Reasons,
}

impl Inbox for Heap {
    fn put(&self, samples: Vec<Sample>) {
        for sample in samples {
            self.values.put(sample);
        }
    }

    fn unreadable(&self, reason: String) {
        self.reasons.put(reason);
    }
}

pub(crate) fn open(session: &Rc<Session>, endpoint: &Endpoint) -> Result<RosSubscriber, OpenError> {
    let address = endpoint.address.to_string();
    let heap = Arc::new(Heap {
        values: SampleQueue::new(endpoint.qos.depth),
        reasons: Reasons::default(),
    });
    let port = session.end(EndpointSpec {
        address: &address,
        topic: names::topic(endpoint, session.rules())?,
        role: Role::Subscriber,
        types: &endpoint.types,
        sends: false,
        qos: qos::topic(&endpoint.qos),
        signal: signal(&address)?,
        is_watched: false,
        inbox: Arc::clone(&heap) as _,
        group: Default::default(),
    })?;
    Ok(RosSubscriber {
        port,
        heap,
        heard: DuplicateFilter::default(),
        unread: Unread::default(),
        address,
    })
}

pub(crate) struct RosSubscriber {
    port: Port,
    heap: Arc<Heap>,
    heard: DuplicateFilter,
    unread: Unread,
    address: String,
}

impl RosSubscriber {
    /// The oldest value that has come.
    fn next(&self) -> Option<Sample> {
        let next = self.heap.values.next();
        next.or_else(|| {
            self.port.state.hear();
            self.heap.values.next()
        })
    }

    fn failed(&self, reason: String) -> ReceiveError {
        ReceiveError {
            address: self.address.clone(),
            reason,
        }
    }
}

impl Subscriber for RosSubscriber {
    fn descriptor(&self) -> BorrowedFd<'_> {
        self.port.state.signal.as_fd()
    }

    fn acknowledge(&mut self, _woken: bool) {
        self.port.state.signal.clear();
    }

    fn receive(&mut self, take: &mut dyn FnMut(Header, &[u8])) -> Result<bool, ReceiveError> {
        if let Some(reason) = self.heap.reasons.next() {
            return Err(self.failed(reason));
        }
        while let Some(sample) = self.next() {
            // Who has other types was told so when it was found.
            let Some(type_hash) = self.port.state.type_hash(&sample.writer) else {
                continue;
            };
            if !self.port.state.contract.transient_local && self.port.state.is_old(&sample) {
                continue;
            }
            let sender = u128::from_be_bytes(sample.writer);
            if !self.heard.is_new(sender, sample.sequence) {
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
