//! The subscriber of a topic.

use crate::inbox;
use crate::names;
use crate::port::{EndpointSpec, Opening, ReaderPort, signal};
use crate::qos::topic_qos;
use crate::session::Session;
use rc_ddsc::Sample;
use rc_middleware::{Endpoint, Header, OpenError, ReceiveError, Subscriber, Unread};
use rc_network::{DuplicateFilter, Role, SampleQueue};
use std::os::fd::{AsFd, BorrowedFd};
use std::rc::Rc;
use std::sync::Arc;

pub(crate) fn open(session: &Rc<Session>, endpoint: &Endpoint) -> Result<DdsSubscriber, OpenError> {
    let address = endpoint.address.to_string();
    let queue = Arc::new(SampleQueue::new(endpoint.qos.depth));
    let spec = EndpointSpec {
        names: names::topic(endpoint),
        role: Role::Subscriber,
        types: &endpoint.types,
        qos: topic_qos(&endpoint.qos),
        signal: signal(&address)?,
    };
    let opening = Opening::begin(session, &address)?;
    let port = opening.reader(spec, Arc::clone(&queue) as _)?;
    opening.meet(&[port.state()]);
    Ok(DdsSubscriber {
        port,
        queue,
        duplicates: DuplicateFilter::default(),
        unread: Unread::default(),
        address,
    })
}

pub(crate) struct DdsSubscriber {
    port: ReaderPort,
    queue: Arc<SampleQueue<Sample>>,
    duplicates: DuplicateFilter,
    unread: Unread,
    address: String,
}

impl Subscriber for DdsSubscriber {
    fn descriptor(&self) -> BorrowedFd<'_> {
        self.port.state().signal.as_fd()
    }

    fn acknowledge(&mut self, _woken: bool) {
        self.port.state().signal.clear();
    }

    fn receive(&mut self, take: &mut dyn FnMut(Header, &[u8])) -> Result<bool, ReceiveError> {
        while let Some(sample) = self.queue.next() {
            // Discovery has reported a sender of other types.
            let Some(sender) = self.port.shared.sender(sample.writer()) else {
                continue;
            };
            // The library drops expired samples in its own queue; a sample can also expire in this
            // one.
            let lifespan = sender.lifespan;
            if lifespan.is_some_and(|lifespan| rc_network::age(sample.stamp()) > lifespan)
                || !self.duplicates.is_new(sender.id, sample.sequence())
            {
                continue;
            }
            return match inbox::body(&sample) {
                Ok(body) => {
                    let mut header = inbox::header(&sample, sender.id, sender.type_hash);
                    self.unread.renumber(&mut header);
                    take(header, body);
                    Ok(true)
                }
                Err(reason) => {
                    self.unread.note(sender.id);
                    Err(ReceiveError {
                        address: self.address.clone(),
                        reason,
                    })
                }
            };
        }
        Ok(false)
    }

    fn peers(&self) -> usize {
        self.port.state().count()
    }
}
