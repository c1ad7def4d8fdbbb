//! The sending end of a topic.

use crate::bell::Bell;
use crate::keeper::Keeper;
use crate::message::MessageHeader;
use crate::names;
use crate::service::{Audience, PublisherPort, Topic, kept_topic, refusal, topic};
use crate::session::Session;
use iceoryx2::prelude::AllocationStrategy;
use iceoryx2::service::port_factory::PortFactory as _;
use rc_middleware::{Durability, Endpoint, Header, OpenError, Publisher, SendError};
use std::fmt::Debug;
use std::sync::Arc;

/// Bytes that a publisher is ready for; its memory grows by doubling.
const INITIAL: usize = 256;

/// Opens the sending end of a topic. A publisher that keeps values is in a service of its own, so that only it pays
/// for them; subscribers are in both.
pub(crate) fn open(
    session: &Arc<Session>,
    endpoint: &Endpoint,
) -> Result<SharedPublisher, OpenError> {
    let (address, types) = (&endpoint.address, &endpoint.types);
    let keeps = endpoint.qos.durability == Durability::TransientLocal;
    let depth = (endpoint.qos.depth as usize).max(1);
    let name = names::topic(address);
    let bell = Bell::open(session, &name, Audience::Topic, Some(types))?;
    let topic = if keeps {
        kept_topic(session, &names::kept(address), types, depth)?
    } else {
        topic(session, &name, types, depth)?
    };
    let port = topic
        .publisher_builder()
        .initial_max_slice_len(INITIAL)
        .allocation_strategy(AllocationStrategy::PowerOfTwo)
        .max_loaned_samples(1)
        .create()
        .map_err(|error| refusal(&name)(format!("{error:?}")))?;
    let port = Arc::new(port);
    let keeper = if keeps {
        Some(Keeper::start(session, endpoint, Arc::clone(&port))?)
    } else {
        None
    };
    if keeps {
        bell.announce();
    }
    Ok(SharedPublisher {
        address: address.to_string(),
        session: Arc::clone(session),
        _keeper: keeper,
        port,
        topic,
        bell,
    })
}

/// The sending end of a topic.
pub(crate) struct SharedPublisher {
    address: String,
    session: Arc<Session>,
    _keeper: Option<Keeper>,
    port: Arc<PublisherPort>,
    topic: Topic,
    bell: Bell,
}

impl Publisher for SharedPublisher {
    fn publish(&mut self, header: Header, body: &[u8]) -> Result<(), SendError> {
        let failed = |error: &dyn Debug| SendError::Backend {
            address: self.address.clone(),
            reason: format!("{error:?}"),
        };
        let mut sample = self
            .port
            .loan_slice_uninit(body.len())
            .map_err(|error| failed(&error))?;
        *sample.user_header_mut() = MessageHeader::new(header);
        let reached = sample
            .write_from_slice(body)
            .send()
            .map_err(|error| failed(&error))?;
        self.bell.ring();
        if reached > 0 {
            self.session.published();
        }
        Ok(())
    }

    fn peers(&self) -> usize {
        self.topic.dynamic_config().number_of_subscribers()
    }
}
