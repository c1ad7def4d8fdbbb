//! The subscriber of a topic.

use crate::message::MessageHeader;
use crate::names;
use crate::notifier::{Listener, Notifier, Wakeup};
use crate::ports::{Received, Service, SubscriberPort, TopicService};
use crate::prompt;
use crate::service::{BORROWED, EventPorts, existing_topic, refusal, topic};
use crate::session::Session;
use crate::tool_ports;
use iceoryx2::service::port_factory::PortFactory as _;
use iceoryx2::service::port_factory::subscriber::PortFactorySubscriber;
use rc_middleware::{
    Durability, Endpoint, Header, KeptSample, OpenError, ReceiveError, Subscriber, Unread, qos,
};
use std::os::fd::BorrowedFd;
use std::sync::Arc;

type SubscriberBuilder<'t> = PortFactorySubscriber<'t, Service, [u8], MessageHeader>;

/// A publisher opens its notifiers before it announces itself: so many looks after a new notifier
/// clear wake-ups.
const RECHECKS: u32 = 3;

/// Opens the subscriber of a topic.
pub(crate) fn open(
    session: &Arc<Session>,
    endpoint: &Endpoint,
) -> Result<SharedSubscriber, OpenError> {
    let name = names::topic(&endpoint.address);
    let types = &endpoint.types;
    // The listener comes first: a transient-local publisher that joins meanwhile notifies it.
    let ports = EventPorts::Topic(qos::publishers(depth(endpoint)));
    let listener = Listener::open(session, &name, ports, Some(types))?;
    let topic = topic(session, &name, types, depth(endpoint))?;
    let mut subscriber = SharedSubscriber {
        volatile: Source::new(endpoint, topic, 0)?,
        transient_local: None,
        transient_local_first: false,
        notifiers: listener.notifiers(),
        rechecks: 0,
        failure: None,
        session: Arc::clone(session),
        endpoint: endpoint.clone(),
        listener,
    };
    let late = endpoint.qos.durability == Durability::TransientLocal;
    subscriber.join_transient_local(if late { depth(endpoint) } else { 0 })?;
    Ok(subscriber)
}

/// The subscriber of a topic.
pub(crate) struct SharedSubscriber {
    /// Samples of volatile publishers.
    volatile: Source,
    /// Samples of transient-local publishers, once there was one.
    transient_local: Option<Source>,
    /// Which source is polled first; it alternates.
    transient_local_first: bool,
    /// The number of notifiers at the last look.
    notifiers: usize,
    /// How many of the next looks clear wake-ups.
    rechecks: u32,
    /// Why the second source could not be opened, until that is reported.
    failure: Option<ReceiveError>,
    endpoint: Endpoint,
    listener: Listener,
    /// Dropped after everything above: the last process that leaves must have no port open.
    session: Arc<Session>,
}

impl SharedSubscriber {
    /// Subscribes to transient-local publishers, if there are any, and requests `history` of their
    /// samples.
    fn join_transient_local(&mut self, history: usize) -> Result<(), OpenError> {
        let address = &self.endpoint.address;
        let name = names::transient_local(address);
        let Some(topic) = existing_topic(&self.session, &name, &self.endpoint.types)? else {
            return Ok(());
        };
        self.transient_local = Some(Source::new(&self.endpoint, topic, history)?);
        if let Some(publishers) = Notifier::existing(&self.session, &names::late_joiners(address)) {
            publishers.notify();
        }
        Ok(())
    }

    /// Subscribes to transient-local publishers when the first one has joined.
    fn handle_wakeup(&mut self, wakeup: Wakeup) {
        if wakeup.transient_local && self.transient_local.is_none() {
            // The whole history of this publisher was sent while this subscriber existed.
            if let Err(error) = self.join_transient_local(depth(&self.endpoint)) {
                self.failure = Some(ReceiveError {
                    address: self.endpoint.address.to_string(),
                    reason: error.to_string(),
                });
            }
        }
    }

    /// Whether wake-ups were cleared because a publisher may have joined without waking this
    /// subscriber: iceoryx2 can swallow the announcement, which no sample follows.
    fn may_have_missed_publisher(&mut self) -> bool {
        let notifiers = self.listener.notifiers();
        if notifiers != self.notifiers {
            self.notifiers = notifiers;
            self.rechecks = RECHECKS;
        }
        if self.rechecks == 0 {
            return false;
        }
        self.rechecks -= 1;
        let wakeup = self.listener.acknowledge(false);
        self.handle_wakeup(wakeup);
        true
    }

    /// Takes one sample.
    fn next(&mut self, take: &mut Take<'_>) -> Result<bool, ReceiveError> {
        if let Some(failure) = self.failure.take() {
            return Err(failure);
        }
        let address = &self.endpoint.address;
        let Some(transient_local) = &mut self.transient_local else {
            return Ok(self.volatile.receive(address.as_str(), take)?
                || (self.may_have_missed_publisher()
                    && self
                        .volatile
                        .receive(self.endpoint.address.as_str(), take)?));
        };
        self.transient_local_first = !self.transient_local_first;
        let (first, second) = if self.transient_local_first {
            (&mut self.volatile, transient_local)
        } else {
            (transient_local, &mut self.volatile)
        };
        Ok(first.receive(address.as_str(), take)? || second.receive(address.as_str(), take)?)
    }
}

impl Subscriber for SharedSubscriber {
    fn descriptor(&self) -> BorrowedFd<'_> {
        self.listener.descriptor()
    }

    fn acknowledge(&mut self, woken: bool) {
        let wakeup = self.listener.acknowledge(woken);
        self.handle_wakeup(wakeup);
    }

    fn receive(&mut self, take: &mut dyn FnMut(Header, &[u8])) -> Result<bool, ReceiveError> {
        self.next(&mut |header, sample, _| take(header, sample.payload()))
    }

    fn can_keep(&self) -> bool {
        self.volatile.can_keep() && self.transient_local.as_ref().is_none_or(Source::can_keep)
    }

    fn receive_kept(
        &mut self,
        take: &mut dyn FnMut(Header, Box<dyn KeptSample>),
    ) -> Result<bool, ReceiveError> {
        let session = Arc::clone(&self.session);
        self.next(&mut |header, sample, port| {
            let kept = Kept {
                sample,
                _port: Arc::clone(port),
                _session: Arc::clone(&session),
            };
            take(header, Box::new(kept));
        })
    }

    fn peers(&self) -> usize {
        self.volatile.peers() + self.transient_local.as_ref().map_or(0, Source::peers)
    }
}

/// A sample that its receiver keeps.
struct Kept {
    sample: Received,
    /// Dropped after the sample: as soon as a port is gone, a publisher writes again into the memory of all
    /// samples that it had.
    _port: Arc<SubscriberPort>,
    /// Dropped after the port: the last process that leaves must have no port open.
    _session: Arc<Session>,
}

impl KeptSample for Kept {
    fn memory(&self) -> &[u8] {
        self.sample.payload()
    }
}

/// Takes a sample, which came to a port.
pub(crate) type Take<'t> = dyn FnMut(Header, Received, &Arc<SubscriberPort>) + 't;

/// One publish/subscribe service.
pub(crate) struct Source {
    port: Arc<SubscriberPort>,
    topic: TopicService,
    unread: Unread,
}

impl Source {
    fn new(endpoint: &Endpoint, topic: TopicService, history: usize) -> Result<Self, OpenError> {
        Self::with(endpoint, topic, history, |builder| builder)
    }

    /// The source of a tool, which is not counted as a peer.
    pub(crate) fn of_tool(
        endpoint: &Endpoint,
        topic: TopicService,
        history: usize,
    ) -> Result<Self, OpenError> {
        let name = tool_ports::port_name();
        Self::with(endpoint, topic, history, |builder| builder.name(&name))
    }

    fn with(
        endpoint: &Endpoint,
        topic: TopicService,
        history: usize,
        set: impl Fn(SubscriberBuilder<'_>) -> SubscriberBuilder<'_>,
    ) -> Result<Self, OpenError> {
        let depth = depth(endpoint).min(topic.static_config().subscriber_max_buffer_size());
        let history = history.min(depth).min(topic.static_config().history_size());
        let open = || {
            let builder = topic
                .subscriber_builder()
                .buffer_size(depth)
                .history_request(history);
            set(builder).create()
        };
        let port = prompt::open(open)
            .map_err(|error| refusal(endpoint.address.as_str())(format!("{error:?}")))?;
        Ok(Self {
            port: Arc::new(port),
            topic,
            unread: Unread::default(),
        })
    }

    /// The service.
    pub(crate) fn topic(&self) -> &TopicService {
        &self.topic
    }

    /// Takes one sample.
    pub(crate) fn receive(
        &mut self,
        address: &str,
        take: &mut Take<'_>,
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
        take(header, sample, &self.port);
        Ok(true)
    }

    /// Whether the creator of the service has reserved memory for samples that are kept.
    fn can_keep(&self) -> bool {
        self.topic.static_config().subscriber_max_borrowed_samples() >= BORROWED
    }

    /// The number of publishers.
    pub(crate) fn peers(&self) -> usize {
        tool_ports::publishers(&self.topic)
    }
}

fn depth(endpoint: &Endpoint) -> usize {
    (endpoint.qos.depth as usize).max(1)
}
