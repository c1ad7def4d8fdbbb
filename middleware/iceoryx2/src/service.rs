//! The services of iceoryx2 with our settings, and what it means when one cannot be opened.

use crate::message::{MessageHeader, RequestHeader};
use crate::session::Session;
use crate::{bounded, names, open_lock};
use iceoryx2::port::{client, listener, notifier, publisher, server, subscriber};
use iceoryx2::prelude::{AttributeVerifier, MessagingPattern, SemanticString, ServiceName};
use iceoryx2::service::Service as _;
use iceoryx2::service::attribute::{AttributeKey, AttributeValue};
use iceoryx2::service::builder;
use iceoryx2::service::builder::publish_subscribe::PublishSubscribeOpenError;
use iceoryx2::service::port_factory::{event, publish_subscribe, request_response};
use rc_middleware::qos::{MAX_NODES, MAX_PUBLISHERS, MAX_READERS, REQUEST_QUEUE};
use rc_middleware::{OpenError, Qos, TypeIdentity};
use std::fmt::Debug;
use std::time::Duration;

/// Ports of this kind may be moved to and shared with other threads: one opens on a helper thread, and a publisher
/// that keeps values is served by a second thread. On disk and in memory it is the same as `ipc::Service`.
pub(crate) type Service = iceoryx2::service::ipc_threadsafe::Service;

pub(crate) type Node = iceoryx2::prelude::Node<Service>;
pub(crate) type EventService = event::PortFactory<Service>;
pub(crate) type ListenerPort = listener::Listener<Service>;
pub(crate) type NotifierPort = notifier::Notifier<Service>;
pub(crate) type TopicService = publish_subscribe::PortFactory<Service, [u8], MessageHeader>;
pub(crate) type PublisherPort = publisher::Publisher<Service, [u8], MessageHeader>;
pub(crate) type Sample = iceoryx2::sample_mut::SampleMut<Service, [u8], MessageHeader>;
pub(crate) type SubscriberPort = subscriber::Subscriber<Service, [u8], MessageHeader>;
pub(crate) type CallService =
    request_response::PortFactory<Service, [u8], RequestHeader, [u8], MessageHeader>;
pub(crate) type ClientPort = client::Client<Service, [u8], RequestHeader, [u8], MessageHeader>;
pub(crate) type ServerPort = server::Server<Service, [u8], RequestHeader, [u8], MessageHeader>;
pub(crate) type PendingResponse =
    iceoryx2::pending_response::PendingResponse<Service, [u8], RequestHeader, [u8], MessageHeader>;
pub(crate) type Response = iceoryx2::response_mut::ResponseMut<Service, [u8], MessageHeader>;
pub(crate) type ActiveRequest =
    iceoryx2::active_request::ActiveRequest<Service, [u8], RequestHeader, [u8], MessageHeader>;

/// The attribute that carries the types of a connection.
const TYPES: &[u8] = b"rc.types";
/// A topic supports subscribers of at least this depth. Each unit costs a publisher 0.13 MB of memory, and 16 kB of
/// shared memory for each connected subscriber: iceoryx2 counts each chunk of each of 255 segments that may follow
/// each other while the memory grows, for the worst case of 64 subscribers who all keep as much as they may. Less than
/// the worst case must not be reserved: a publisher that has no chunk left makes new segments until it has none left.
const DEPTH: usize = Qos::PUBLISHER.depth as usize;
/// How often an opening is tried that meets a service which just comes or goes, or whose users died.
const ATTEMPTS: u32 = 4;
/// Between two attempts.
const PAUSE: Duration = Duration::from_millis(20);

/// Which notifiers and listeners an event service has room for.
#[derive(Clone, Copy)]
pub(crate) enum EventPorts {
    /// Many publishers wake many subscribers.
    Topic,
    /// Many subscribers wake the publishers that keep values.
    LateJoiners,
    /// Many clients wake the server. There is room for one that died and for one that is refused.
    Server,
    /// The server wakes one client. There is room for servers that died.
    Client,
}

impl EventPorts {
    fn limits(self) -> (usize, usize) {
        match self {
            // A publisher that keeps values has two notifiers.
            Self::Topic => (2 * MAX_PUBLISHERS, MAX_READERS),
            Self::LateJoiners => (MAX_READERS, MAX_PUBLISHERS),
            Self::Server => (MAX_READERS, 4),
            Self::Client => (4, 1),
        }
    }
}

/// The publish/subscribe service `name`. `depth`: what this end needs.
pub(crate) fn topic(
    session: &Session,
    name: &str,
    types: &TypeIdentity,
    depth: usize,
) -> Result<TopicService, OpenError> {
    let verifier = require(name, types)?;
    session.attempt(name, MessagingPattern::PublishSubscribe, types, |service| {
        topic_builder(session, service)
            .subscriber_max_buffer_size(depth.max(DEPTH))
            .history_size(0)
            .open_or_create_with_attributes(&verifier)
            .or_else(|_| {
                // The one who created it wanted less than we would have created, but perhaps enough.
                topic_builder(session, service)
                    .subscriber_max_buffer_size(depth)
                    .open_with_attributes(&verifier)
            })
    })
}

/// The publish/subscribe service `name` whose publishers keep values; made with `depth` of them if it is not there.
pub(crate) fn transient_local_topic(
    session: &Session,
    name: &str,
    types: &TypeIdentity,
    depth: usize,
) -> Result<TopicService, OpenError> {
    let verifier = require(name, types)?;
    session.attempt(
        name,
        MessagingPattern::PublishSubscribe,
        types,
        |service| match topic_builder(session, service).open_with_attributes(&verifier) {
            Ok(topic) => Ok(topic),
            Err(_) => topic_builder(session, service)
                .subscriber_max_buffer_size(depth.max(DEPTH))
                .history_size(depth)
                .open_or_create_with_attributes(&verifier),
        },
    )
}

/// The publish/subscribe service `name` whose publishers keep values, where there is one.
pub(crate) fn existing_transient_local_topic(
    session: &Session,
    name: &str,
    types: &TypeIdentity,
) -> Result<Option<TopicService>, OpenError> {
    let verifier = require(name, types)?;
    session.attempt(
        name,
        MessagingPattern::PublishSubscribe,
        types,
        |service| match topic_builder(session, service).open_with_attributes(&verifier) {
            Ok(topic) => Ok(Some(topic)),
            Err(PublishSubscribeOpenError::DoesNotExist) => Ok(None),
            Err(error) => Err(error),
        },
    )
}

/// The request/response service `name`.
pub(crate) fn calls(
    session: &Session,
    name: &str,
    types: &TypeIdentity,
) -> Result<CallService, OpenError> {
    let verifier = require(name, types)?;
    session.attempt(name, MessagingPattern::RequestResponse, types, |service| {
        session
            .node
            .service_builder(service)
            .request_response::<[u8], [u8]>()
            .request_user_header::<RequestHeader>()
            .response_user_header::<MessageHeader>()
            .enable_safe_overflow_for_requests(false)
            .enable_safe_overflow_for_responses(false)
            .enable_fire_and_forget_requests(true)
            .max_active_requests_per_client(REQUEST_QUEUE)
            .max_loaned_requests(1)
            .max_response_buffer_size(1)
            .max_borrowed_responses_per_pending_response(1)
            .max_servers(1)
            .max_clients(MAX_READERS)
            .max_nodes(MAX_NODES)
            .open_or_create_with_attributes(&verifier)
    })
}

/// The event service `name`; with `types`, ends of other types are refused.
pub(crate) fn event(
    session: &Session,
    name: &str,
    ports: EventPorts,
    types: Option<&TypeIdentity>,
) -> Result<EventService, OpenError> {
    let (notifiers, listeners) = ports.limits();
    let (verifier, types) = match types {
        Some(types) => (require(name, types)?, types),
        None => (AttributeVerifier::new(), &NO_TYPES),
    };
    session.attempt(name, MessagingPattern::Event, types, |service| {
        session
            .node
            .service_builder(service)
            .event()
            .max_notifiers(notifiers)
            .max_listeners(listeners)
            .max_nodes(MAX_NODES)
            .event_id_max_value(crate::notifier::TRANSIENT_LOCAL)
            .open_or_create_with_attributes(&verifier)
    })
}

/// The event service `name` as another end made it.
pub(crate) fn existing_event(session: &Session, name: &str) -> Option<EventService> {
    let service = ServiceName::new(name).ok()?;
    session.node.service_builder(&service).event().open().ok()
}

const NO_TYPES: TypeIdentity = TypeIdentity {
    name: String::new(),
    hash: 0,
};

fn topic_builder(
    session: &Session,
    service: &ServiceName,
) -> builder::publish_subscribe::Builder<[u8], MessageHeader, Service> {
    session
        .node
        .service_builder(service)
        .publish_subscribe::<[u8]>()
        .user_header::<MessageHeader>()
        .enable_safe_overflow(true)
        .subscriber_max_borrowed_samples(1)
        .max_publishers(MAX_PUBLISHERS)
        .max_subscribers(MAX_READERS)
        .max_nodes(MAX_NODES)
}

/// What an opener requires, and a creator defines.
fn require(name: &str, types: &TypeIdentity) -> Result<AttributeVerifier, OpenError> {
    let refused = |reason: String| OpenError::Backend {
        address: name.to_owned(),
        reason: format!("the name of its types cannot be an attribute of a service: {reason}"),
    };
    let key = AttributeKey::new(TYPES).map_err(|e| refused(format!("{e:?}")))?;
    let value =
        AttributeValue::new(types.to_string().as_bytes()).map_err(|e| refused(format!("{e:?}")))?;
    AttributeVerifier::new()
        .require(&key, &value)
        .map_err(|e| refused(format!("{e:?}")))
}

impl Session {
    /// Tries `open` some times, with what the dead left cleaned up in between.
    fn attempt<T, E: Debug>(
        &self,
        name: &str,
        pattern: MessagingPattern,
        types: &TypeIdentity,
        open: impl Fn(&ServiceName) -> Result<T, E>,
    ) -> Result<T, OpenError> {
        let refused = |reason: String| OpenError::Backend {
            address: name.to_owned(),
            reason,
        };
        let service = ServiceName::new(name).map_err(|e| refused(format!("{e:?}")))?;
        let directory = &self.environment.directory;
        let root = names::root(directory);
        let mut attempt = 1;
        loop {
            let outcome = {
                let _lock = open_lock::shared(&root);
                open(&service)
            };
            let error = match outcome {
                Ok(opened) => return Ok(opened),
                Err(error) => error,
            };
            // What was met may be of the dead, its types and settings, too.
            if self.clean() > 0 && attempt < ATTEMPTS {
                attempt += 1;
                continue;
            }
            if let Some(theirs) = self.other_types(&service, pattern, types) {
                return Err(OpenError::TypeMismatch {
                    address: name.to_owned(),
                    ours: types.to_string(),
                    theirs,
                });
            }
            if attempt == ATTEMPTS {
                let reason = explain(&error);
                return Err(refused(if is_incomplete(&error) {
                    format!("{reason}; {}", bounded::recovery_hint(directory))
                } else {
                    reason
                }));
            }
            attempt += 1;
            std::thread::sleep(PAUSE);
        }
    }

    /// What the service that is there says of its types, where that differs from `types`.
    fn other_types(
        &self,
        service: &ServiceName,
        pattern: MessagingPattern,
        types: &TypeIdentity,
    ) -> Option<String> {
        let key = AttributeKey::new(TYPES).ok()?;
        let details = Service::details(service, &self.config, pattern).ok()??;
        let theirs = match details.static_details.attributes().key_value(&key, 0) {
            Some(value) => String::from_utf8_lossy(value.as_bytes()).into_owned(),
            None => "types that it does not name".to_owned(),
        };
        (types.name != NO_TYPES.name && theirs != types.to_string()).then_some(theirs)
    }
}

fn explain(error: &impl Debug) -> String {
    let text = format!("{error:?}");
    let help = if is_incomplete(error) {
        "a process that was killed while it started or ended left it half made"
    } else if text.contains("MinBufferSize") {
        "an end that keeps fewer values made it; start the end that keeps most values first"
    } else if text.contains("ExceedsMax") {
        "too many ends of this kind are open"
    } else {
        return format!("iceoryx2 says {text}");
    };
    format!("iceoryx2 says {text}: {help}")
}

/// Whether an error says that a service is neither there nor not there.
fn is_incomplete(error: &impl Debug) -> bool {
    let text = format!("{error:?}");
    ["HangsInCreation", "Corrupted", "IsMarkedForDestruction"]
        .iter()
        .any(|said| text.contains(said))
}

/// `iceoryx2 says …`, for a port that could not be made.
pub(crate) fn refusal(address: &str) -> impl FnOnce(String) -> OpenError + '_ {
    move |reason| OpenError::Backend {
        address: address.to_owned(),
        reason: explain(&reason),
    }
}
