//! The subscriber of a topic.

use crate::port::{EndpointSpec, Opening, ReaderPort};
use crate::sample::{body, sample_header};
use crate::{DuplicateFilter, SampleQueue, Session, age};
use rc_ddsc::Sample;
use rc_middleware::{Header, OpenError, QueueGauge, ReceiveError, Subscriber, Unread};
use std::os::fd::{AsFd, BorrowedFd};
use std::rc::Rc;
use std::sync::Arc;

/// The subscriber of a topic.
pub struct TopicSubscriber {
    port: ReaderPort,
    queue: Arc<SampleQueue<Sample>>,
    duplicates: DuplicateFilter,
    unread: Unread,
    address: String,
}

impl TopicSubscriber {
    /// Opens the subscriber at `address`, which keeps the last `depth` samples.
    pub fn open(
        session: &Rc<Session>,
        address: &str,
        spec: EndpointSpec<'_>,
        depth: u32,
    ) -> Result<Self, OpenError> {
        let queue = Arc::new(SampleQueue::new(depth, session.queue_limit()));
        let opening = Opening::begin(session, address)?;
        let port = opening.reader(spec, Arc::clone(&queue) as _)?;
        opening.meet(&[port.state()]);
        Ok(Self {
            port,
            queue,
            duplicates: DuplicateFilter::default(),
            unread: Unread::default(),
            address: address.to_owned(),
        })
    }

    /// Reader of the samples.
    pub fn port(&self) -> &ReaderPort {
        &self.port
    }
}

impl Subscriber for TopicSubscriber {
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
            if lifespan.is_some_and(|lifespan| age(sample.stamp()) > lifespan)
                || !self.duplicates.is_new(sender.id, sample.sequence())
            {
                continue;
            }
            return match body(&sample) {
                Ok(body) => {
                    let mut header = sample_header(&sample, sender.id, sender.type_hash);
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

    fn queue(&self) -> Option<QueueGauge> {
        Some(self.queue.gauge().clone())
    }
}
