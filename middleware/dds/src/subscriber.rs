//! The receiving end of a topic.

use crate::inbox;
use crate::publisher::{signal, type_name};
use crate::qos::topic_qos;
use crate::session::{EndpointSpec, Port, Session};
use rc_ddsc::Sample;
use rc_middleware::{Endpoint, Header, OpenError, ReceiveError, Subscriber, Unread};
use rc_network::{DuplicateFilter, Role, SampleQueue};
use std::os::fd::{AsFd, BorrowedFd};
use std::rc::Rc;
use std::sync::Arc;

pub(crate) fn open(session: &Rc<Session>, endpoint: &Endpoint) -> Result<DdsSubscriber, OpenError> {
    let address = endpoint.address.to_string();
    let values = Arc::new(SampleQueue::new(endpoint.qos.depth));
    let [port] = session.ports([EndpointSpec {
        address: &address,
        topic: address.clone(),
        type_name: type_name(endpoint),
        role: Role::Subscriber,
        types: &endpoint.types,
        sends: false,
        qos: topic_qos(&endpoint.qos),
        signal: signal(&address)?,
        inbox: Arc::clone(&values) as _,
    }])?;
    Ok(DdsSubscriber {
        port,
        values,
        heard: DuplicateFilter::default(),
        unread: Unread::default(),
        address,
    })
}

pub(crate) struct DdsSubscriber {
    port: Port,
    values: Arc<SampleQueue<Sample>>,
    heard: DuplicateFilter,
    unread: Unread,
    address: String,
}

impl Subscriber for DdsSubscriber {
    fn descriptor(&self) -> BorrowedFd<'_> {
        self.port.state.signal.as_fd()
    }

    fn acknowledge(&mut self, _woken: bool) {
        self.port.state.signal.clear();
    }

    fn receive(&mut self, take: &mut dyn FnMut(Header, &[u8])) -> Result<bool, ReceiveError> {
        while let Some(sample) = self.values.next() {
            // Who has other types was told so when it was found.
            let Some(sender) = self.port.state.sender(sample.writer()) else {
                continue;
            };
            // The library takes care of it in its own queue; here, too, a value may have waited for too long.
            let lifespan = sender.lifespan;
            if lifespan.is_some_and(|lifespan| rc_network::age(sample.stamp()) > lifespan)
                || !self.heard.is_new(sender.id, sample.sequence())
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
        self.port.state.count()
    }
}
