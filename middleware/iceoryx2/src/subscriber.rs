//! The receiving end of a topic.

use crate::bell::{Bell, Ear, Heard};
use crate::names;
use crate::service::{Audience, SubscriberPort, Topic, existing_kept_topic, refusal, topic};
use crate::session::Session;
use iceoryx2::service::port_factory::PortFactory as _;
use rc_middleware::{Durability, Endpoint, Header, OpenError, ReceiveError, Subscriber, Unread};
use std::os::fd::BorrowedFd;
use std::sync::Arc;

/// Opens the receiving end of a topic.
pub(crate) fn open(
    session: &Arc<Session>,
    endpoint: &Endpoint,
) -> Result<SharedSubscriber, OpenError> {
    let name = names::topic(&endpoint.address);
    let types = &endpoint.types;
    // The ear comes first: a publisher that keeps values and is made meanwhile announces itself to it.
    let ear = Ear::open(session, &name, Audience::Topic, Some(types))?;
    let topic = topic(session, &name, types, depth(endpoint))?;
    let mut subscriber = SharedSubscriber {
        live: Source::new(endpoint, topic, 0)?,
        kept: None,
        kept_next: false,
        failure: None,
        session: Arc::clone(session),
        endpoint: endpoint.clone(),
        ear,
    };
    let late = endpoint.qos.durability == Durability::TransientLocal;
    subscriber.join_keepers(if late { depth(endpoint) } else { 0 })?;
    Ok(subscriber)
}

/// The receiving end of a topic.
pub(crate) struct SharedSubscriber {
    /// From publishers that keep nothing.
    live: Source,
    /// From publishers that keep values, once there was one.
    kept: Option<Source>,
    /// Which of both is asked first.
    kept_next: bool,
    /// Why the second one could not be opened, until that was told.
    failure: Option<ReceiveError>,
    endpoint: Endpoint,
    ear: Ear,
    /// Left after everything above: the last one out must have no end open.
    session: Arc<Session>,
}

impl SharedSubscriber {
    /// Subscribes to publishers that keep values, where there are some, and asks for `history` of them.
    fn join_keepers(&mut self, history: usize) -> Result<(), OpenError> {
        let address = &self.endpoint.address;
        let name = names::kept(address);
        let Some(topic) = existing_kept_topic(&self.session, &name, &self.endpoint.types)? else {
            return Ok(());
        };
        self.kept = Some(Source::new(&self.endpoint, topic, history)?);
        if let Some(keepers) = Bell::existing(&self.session, &names::late(address)) {
            keepers.ring();
        }
        Ok(())
    }

    /// Joins the publishers that keep values, where the first of them has come.
    fn heard(&mut self, heard: Heard) {
        if heard.kept && self.kept.is_none() {
            // All that this publisher has kept was sent while we were here already.
            if let Err(error) = self.join_keepers(depth(&self.endpoint)) {
                self.failure = Some(ReceiveError {
                    address: self.endpoint.address.to_string(),
                    reason: error.to_string(),
                });
            }
        }
    }

    /// Takes one value.
    fn next(&mut self, take: &mut dyn FnMut(Header, &[u8])) -> Result<bool, ReceiveError> {
        if let Some(failure) = self.failure.take() {
            return Err(failure);
        }
        let address = &self.endpoint.address;
        let Some(kept) = &mut self.kept else {
            return self.live.receive(address.as_str(), take);
        };
        self.kept_next = !self.kept_next;
        let (first, second) = if self.kept_next {
            (&mut self.live, kept)
        } else {
            (kept, &mut self.live)
        };
        Ok(first.receive(address.as_str(), take)? || second.receive(address.as_str(), take)?)
    }
}

impl Subscriber for SharedSubscriber {
    fn descriptor(&self) -> BorrowedFd<'_> {
        self.ear.descriptor()
    }

    fn acknowledge(&mut self, woken: bool) {
        let heard = self.ear.take(woken);
        self.heard(heard);
    }

    fn receive(&mut self, take: &mut dyn FnMut(Header, &[u8])) -> Result<bool, ReceiveError> {
        self.next(take)
    }

    fn peers(&self) -> usize {
        self.live.peers() + self.kept.as_ref().map_or(0, Source::peers)
    }
}

/// One service that values come from.
struct Source {
    port: SubscriberPort,
    topic: Topic,
    unread: Unread,
}

impl Source {
    fn new(endpoint: &Endpoint, topic: Topic, history: usize) -> Result<Self, OpenError> {
        let depth = depth(endpoint).min(topic.static_config().subscriber_max_buffer_size());
        let history = history.min(depth).min(topic.static_config().history_size());
        let port = topic
            .subscriber_builder()
            .buffer_size(depth)
            .history_request(history)
            .create()
            .map_err(|error| refusal(endpoint.address.as_str())(format!("{error:?}")))?;
        Ok(Self {
            port,
            topic,
            unread: Unread::default(),
        })
    }

    fn receive(
        &mut self,
        address: &str,
        take: &mut dyn FnMut(Header, &[u8]),
    ) -> Result<bool, ReceiveError> {
        let failed = |reason: String| ReceiveError {
            address: address.to_owned(),
            reason,
        };
        let received = self.port.receive().map_err(|e| failed(format!("{e:?}")))?;
        let Some(sample) = received else {
            return Ok(false);
        };
        let sender = sample.origin().value();
        let mut header = match sample.user_header().read(sender) {
            Ok(header) => header,
            Err(reason) => {
                self.unread.note(sender);
                return Err(failed(reason));
            }
        };
        self.unread.renumber(&mut header);
        take(header, sample.payload());
        Ok(true)
    }

    fn peers(&self) -> usize {
        self.topic.dynamic_config().number_of_publishers()
    }
}

fn depth(endpoint: &Endpoint) -> usize {
    (endpoint.qos.depth as usize).max(1)
}
