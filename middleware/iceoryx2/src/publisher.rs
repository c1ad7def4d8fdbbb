//! The publisher of a topic.

use crate::late_joiners::LateJoinerThread;
use crate::memory;
use crate::message::MessageHeader;
use crate::names;
use crate::notifier::Notifier;
use crate::ports::{PublisherPort, Sample, Service, TopicService};
use crate::prompt;
use crate::service::{EventPorts, existing_topic, refusal, topic, transient_local_topic};
use crate::session::Session;
use crate::tool_ports;
use iceoryx2::prelude::AllocationStrategy;
use iceoryx2::service::port_factory::PortFactory as _;
use iceoryx2::service::port_factory::publisher::PortFactoryPublisher;
use iceoryx2::service::static_config::publish_subscribe::StaticConfig;
use rc_middleware::{
    Durability, Encoding, Endpoint, Header, LoanedSample, OpenError, Publisher, SendError, qos,
};
use std::fmt::Debug;
use std::sync::Arc;

/// Initial size of a sample in bytes; the memory grows by doubling.
const INITIAL: usize = 256;

/// Opens the publisher of a topic. Transient-local publishers have a service of their own, so that
/// volatile ones do not reserve memory for history; subscribers join both services.
pub(crate) fn open(
    session: &Arc<Session>,
    endpoint: &Endpoint,
) -> Result<SharedPublisher, OpenError> {
    let (address, types) = (&endpoint.address, &endpoint.types);
    let keeps = endpoint.qos.durability == Durability::TransientLocal;
    let depth = (endpoint.qos.depth as usize).max(1);
    let publishers = qos::publishers(depth);
    let name = names::topic(address);
    let ports = EventPorts::Topic(publishers);
    let notifier = Notifier::open(session, &name, ports, Some(types))?;
    let topic = if keeps {
        transient_local_topic(session, &names::transient_local(address), types, depth)?
    } else {
        topic(session, &name, types, depth)?
    };
    let port = prompt::open(|| SharedPublisher::builder(&topic).create())
        .map_err(|error| refusal(&name)(format!("{error:?}")))?;
    let port = Arc::new(port);
    let late_joiners = if keeps {
        Some(LateJoinerThread::start(
            session,
            endpoint,
            Arc::clone(&port),
        )?)
    } else {
        None
    };
    if keeps {
        notifier.announce_transient_local();
    }
    Ok(SharedPublisher {
        address: address.to_string().into(),
        session: Arc::clone(session),
        _late_joiners: late_joiners,
        port,
        topic,
        notifier: Arc::new(notifier),
    })
}

/// The publisher of a topic.
pub(crate) struct SharedPublisher {
    address: Arc<str>,
    _late_joiners: Option<LateJoinerThread>,
    port: Arc<PublisherPort>,
    topic: TopicService,
    notifier: Arc<Notifier>,
    /// Dropped after everything above: the last process that leaves must have no port open.
    session: Arc<Session>,
}

/// How many samples a publisher needs at most. iceoryx2 counts a buffer for each subscriber, but all
/// buffers hold the newest samples, and so the same ones: only borrowed samples differ. iceoryx2 keeps
/// a counter for each sample in each of 255 segments: 2 kB of memory, and 255 bytes of shared memory
/// for each connection. A publisher without a free sample creates new segments until none is left, so
/// less must not be reserved.
fn samples(service: &StaticConfig) -> impl Fn(usize) -> usize + use<> {
    let borrowed = service.max_subscribers() * service.subscriber_max_borrowed_samples();
    let newest = service.subscriber_max_buffer_size() + service.history_size();
    // One that is written, and one that is replaced.
    let most = borrowed + newest + 2;
    move |of_iceoryx2| most.min(of_iceoryx2)
}

type PublisherBuilder<'t> = PortFactoryPublisher<'t, Service, [u8], MessageHeader>;

impl SharedPublisher {
    /// The settings of a port.
    pub(crate) fn builder(topic: &TopicService) -> PublisherBuilder<'_> {
        topic
            .publisher_builder()
            .initial_max_slice_len(INITIAL)
            .allocation_strategy(AllocationStrategy::PowerOfTwo)
            .max_loaned_samples(1)
            .override_sample_preallocation(samples(topic.static_config()))
    }

    /// The publisher of a tool, which is not counted as a peer.
    pub(crate) fn of_tool(session: &Arc<Session>, endpoint: &Endpoint) -> Result<Self, OpenError> {
        let name = names::topic(&endpoint.address);
        let Some(topic) = existing_topic(session, &name, &endpoint.types)? else {
            return Err(OpenError::Backend {
                address: endpoint.address.to_string(),
                reason: "no component subscribes to it".to_owned(),
            });
        };
        let tool = tool_ports::port_name();
        let port = prompt::open(|| Self::builder(&topic).name(&tool).create());
        let port = port.map_err(|error| refusal(&name)(format!("{error:?}")))?;
        let publishers = qos::publishers(endpoint.qos.depth as usize);
        let (ports, types) = (EventPorts::Topic(publishers), Some(&endpoint.types));
        let notifier = Notifier::open(session, &name, ports, types)?;
        Ok(Self {
            address: endpoint.address.to_string().into(),
            _late_joiners: None,
            port: Arc::new(port),
            topic,
            notifier: Arc::new(notifier),
            session: Arc::clone(session),
        })
    }

    fn failed(&self, error: &dyn Debug) -> SendError {
        SendError::Backend {
            address: self.address.to_string(),
            reason: format!("{error:?}"),
        }
    }

    /// Notifies the subscribers after a sample was sent.
    fn sent(
        &self,
        at: u64,
        reached: Result<usize, iceoryx2::port::SendError>,
    ) -> Result<(), SendError> {
        announce(&self.address, &self.notifier, &self.session, at, reached)
    }
}

impl Publisher for SharedPublisher {
    fn publish(&mut self, header: Header, body: &[u8]) -> Result<(), SendError> {
        let mut sample = self
            .port
            .loan_slice_uninit(body.len())
            .map_err(|error| self.failed(&error))?;
        *sample.user_header_mut() = MessageHeader::new(header);
        self.sent(header.sent, sample.write_from_slice(body).send())
    }

    fn can_loan(&self, _: Encoding) -> bool {
        true
    }

    fn loan(&mut self, length: usize) -> Result<Box<dyn LoanedSample + '_>, SendError> {
        let sample = self
            .port
            .loan_slice_uninit(length)
            .map_err(|error| self.failed(&error))?;
        Ok(Box::new(SharedLoan {
            publisher: self,
            sample: memory::sample(sample),
        }))
    }

    fn loan_image(&mut self, length: usize) -> Result<Option<Box<dyn LoanedSample>>, SendError> {
        let sample = self
            .port
            .loan_slice_uninit(length)
            .map_err(|error| self.failed(&error))?;
        Ok(Some(Box::new(KeptLoan {
            address: Arc::clone(&self.address),
            sample: memory::sample(sample),
            notifier: Arc::clone(&self.notifier),
            session: Arc::clone(&self.session),
        })))
    }

    fn senders(&self) -> Vec<u128> {
        vec![self.port.id().value()]
    }

    fn peers(&self) -> usize {
        tool_ports::subscribers(&self.topic)
    }
}

/// A sample that is being written in place, and does not borrow its publisher.
struct KeptLoan {
    address: Arc<str>,
    sample: Sample,
    notifier: Arc<Notifier>,
    /// Dropped after everything above.
    session: Arc<Session>,
}

impl LoanedSample for KeptLoan {
    fn memory(&self) -> &[u8] {
        self.sample.payload()
    }

    fn memory_mut(&mut self) -> &mut [u8] {
        self.sample.payload_mut()
    }

    fn send(self: Box<Self>, header: Header) -> Result<(), SendError> {
        let mut loan = *self;
        *loan.sample.user_header_mut() = MessageHeader::new(header);
        let reached = loan.sample.send();
        let (notifier, session) = (&loan.notifier, &loan.session);
        announce(&loan.address, notifier, session, header.sent, reached)
    }
}

/// Notifies the subscribers after a sample was sent.
fn announce(
    address: &str,
    notifier: &Notifier,
    session: &Session,
    at: u64,
    reached: Result<usize, iceoryx2::port::SendError>,
) -> Result<(), SendError> {
    let reached = reached.map_err(|error| SendError::Backend {
        address: address.to_owned(),
        reason: format!("{error:?}"),
    })?;
    notifier.notify();
    if reached > 0 {
        session.note_published(at);
    }
    Ok(())
}

/// A sample that is being written in place.
struct SharedLoan<'a> {
    publisher: &'a SharedPublisher,
    sample: Sample,
}

impl LoanedSample for SharedLoan<'_> {
    fn memory(&self) -> &[u8] {
        self.sample.payload()
    }

    fn memory_mut(&mut self) -> &mut [u8] {
        self.sample.payload_mut()
    }

    fn send(mut self: Box<Self>, header: Header) -> Result<(), SendError> {
        *self.sample.user_header_mut() = MessageHeader::new(header);
        self.publisher.sent(header.sent, self.sample.send())
    }
}
