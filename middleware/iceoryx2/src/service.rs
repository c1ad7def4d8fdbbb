//! iceoryx2 services with the settings of this backend, and the meaning of errors when one cannot
//! be opened.

use crate::message::{MessageHeader, RequestHeader};
use crate::ports::{CallService, EventService, Service, TopicService};
use crate::session::Session;
use crate::{bounded, open_lock};
use iceoryx2::prelude::{AttributeVerifier, MessagingPattern, SemanticString, ServiceName};
use iceoryx2::service::Service as _;
use iceoryx2::service::attribute::{AttributeKey, AttributeValue};
use iceoryx2::service::builder;
use iceoryx2::service::builder::publish_subscribe::PublishSubscribeOpenError;
use rc_middleware::qos::{
    self, MAX_NODES, MAX_OBSERVERS, MAX_PUBLISHERS, MAX_READERS, REQUEST_QUEUE,
};
use rc_middleware::{KEPT_SAMPLES, OpenError, Qos, TypeIdentity};
use std::fmt::Debug;
use std::time::{Duration, Instant};

/// Event id: a message may be in the queue.
pub(crate) const DATA: usize = 0;
/// Event id: a transient-local publisher has joined the topic.
pub(crate) const TRANSIENT_LOCAL: usize = 1;
/// The service attribute with the types of a connection.
const TYPES: &[u8] = b"rc.types";
/// Smallest maximum depth of a topic's subscribers. Each unit is one more sample of a publisher,
/// see [`crate::publisher`].
const DEPTH: usize = Qos::PUBLISHER.depth as usize;
/// How many samples a subscriber may have: the one that is handled and those that it keeps. Each
/// costs a publisher 0.14 MB of memory, and 17 kB of shared memory for each connected subscriber:
/// each of 68 subscribers may keep another sample.
pub(crate) const BORROWED: usize = 1 + KEPT_SAMPLES;
/// Attempts to open a service that is being created or removed, or whose users have died.
const ATTEMPTS: u32 = 4;
/// How long an opening is tried again as long as dead nodes are removed.
const PATIENCE: Duration = Duration::from_secs(4);
/// Pause between two attempts.
const PAUSE: Duration = Duration::from_millis(20);

/// The use of an event service, which determines how many notifiers and listeners it admits.
#[derive(Clone, Copy)]
pub(crate) enum EventPorts {
    /// This many publishers notify subscribers.
    Topic(usize),
    /// Subscribers notify so many transient-local publishers.
    LateJoiners(usize),
    /// Clients notify the server. Admits a dead server and a refused one, too.
    Server,
    /// The server notifies one client. Admits dead servers, too.
    Client,
}

impl EventPorts {
    fn limits(self) -> (usize, usize) {
        match self {
            // A transient-local publisher has two notifiers.
            Self::Topic(publishers) => (2 * publishers + MAX_OBSERVERS, MAX_READERS),
            Self::LateJoiners(publishers) => (MAX_READERS, publishers),
            Self::Server => (MAX_READERS, 4),
            Self::Client => (4, 1),
        }
    }
}

/// Opens or creates the publish/subscribe service `name`. `depth` is what this endpoint needs.
pub(crate) fn topic(
    session: &Session,
    name: &str,
    types: &TypeIdentity,
    depth: usize,
) -> Result<TopicService, OpenError> {
    let verifier = require(name, types)?;
    session.attempt(name, MessagingPattern::PublishSubscribe, types, |service| {
        topic_builder(session, service, qos::publishers(depth))
            .subscriber_max_buffer_size(depth.max(DEPTH))
            .subscriber_max_borrowed_samples(BORROWED)
            .history_size(0)
            .open_or_create_with_attributes(&verifier)
            .or_else(|_| {
                // The creator may have reserved less than the minimum of this process, but enough
                // for this endpoint, which then keeps no samples.
                topic_builder(session, service, MAX_PUBLISHERS)
                    .subscriber_max_buffer_size(depth)
                    .open_with_attributes(&verifier)
            })
    })
}

/// Opens the publish/subscribe service `name` of transient-local publishers, or creates it with a
/// history of `depth`.
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
        |service| match topic_builder(session, service, MAX_PUBLISHERS)
            .open_with_attributes(&verifier)
        {
            Ok(topic) => Ok(topic),
            Err(_) => topic_builder(session, service, qos::publishers(depth))
                .subscriber_max_buffer_size(depth.max(DEPTH))
                .subscriber_max_borrowed_samples(BORROWED)
                .history_size(depth)
                .open_or_create_with_attributes(&verifier),
        },
    )
}

/// Opens the publish/subscribe service `name`, if it exists.
pub(crate) fn existing_topic(
    session: &Session,
    name: &str,
    types: &TypeIdentity,
) -> Result<Option<TopicService>, OpenError> {
    let verifier = require(name, types)?;
    session.attempt(
        name,
        MessagingPattern::PublishSubscribe,
        types,
        |service| match topic_builder(session, service, MAX_PUBLISHERS)
            .open_with_attributes(&verifier)
        {
            Ok(topic) => Ok(Some(topic)),
            Err(PublishSubscribeOpenError::DoesNotExist) => Ok(None),
            Err(error) => Err(error),
        },
    )
}

/// Opens or creates the request/response service `name`.
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
            // A reply that arrives after its call has ended stays in its channel. The reply to the
            // next call of that channel replaces it.
            .enable_safe_overflow_for_responses(true)
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

/// Opens or creates the event service `name`. With `types`, endpoints of other types are refused.
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
        let builder = || session.node.service_builder(service).event();
        builder()
            .max_notifiers(notifiers)
            .max_listeners(listeners)
            .max_nodes(MAX_NODES)
            .event_id_max_value(TRANSIENT_LOCAL)
            .open_or_create_with_attributes(&verifier)
            // The service of a topic with a smaller depth has fewer notifiers.
            .or_else(|_| builder().open_with_attributes(&verifier))
    })
}

/// Opens the event service `name`, if it exists.
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
    publishers: usize,
) -> builder::publish_subscribe::Builder<[u8], MessageHeader, Service> {
    session
        .node
        .service_builder(service)
        .publish_subscribe::<[u8]>()
        .user_header::<MessageHeader>()
        .enable_safe_overflow(true)
        .max_publishers(publishers + MAX_OBSERVERS)
        .max_subscribers(MAX_READERS + MAX_OBSERVERS)
        .max_nodes(MAX_NODES)
}

/// The types as an attribute, which an opener requires and a creator defines.
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
    /// Tries `open` several times and cleans up after dead processes in between.
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
        let end = Instant::now() + PATIENCE;
        let mut attempt = 1;
        loop {
            let outcome = {
                let _lock = open_lock::shared(&self.place.root);
                open(&service)
            };
            let error = match outcome {
                Ok(opened) => return Ok(opened),
                Err(error) => error,
            };
            // The service may belong to dead processes, with other types and settings.
            if Instant::now() < end && self.clean_some() > 0 {
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

    /// The types of the existing service, if they differ from `types`.
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
            None => "unnamed types".to_owned(),
        };
        (types.name != NO_TYPES.name && theirs != types.to_string()).then_some(theirs)
    }
}

fn explain(error: &impl Debug) -> String {
    let text = format!("{error:?}");
    let help = if is_incomplete(error) {
        "a process that was killed while it started or ended left it incomplete"
    } else if text.contains("MinBufferSize") {
        "an endpoint of a smaller depth created it; start the endpoint of the greatest depth first"
    } else if text.contains("ExceedsMax") {
        "too many endpoints of this kind are open"
    } else if text.contains("OverflowBehavior") {
        "a program of another version of the framework created it; build all programs of the network again"
    } else {
        return format!("iceoryx2 says {text}");
    };
    format!("iceoryx2 says {text}: {help}")
}

/// Whether an error says that a service exists only in part.
fn is_incomplete(error: &impl Debug) -> bool {
    let text = format!("{error:?}");
    ["HangsInCreation", "Corrupted", "IsMarkedForDestruction"]
        .iter()
        .any(|said| text.contains(said))
}

/// The error of a port that could not be created.
pub(crate) fn refusal(address: &str) -> impl FnOnce(String) -> OpenError + '_ {
    move |reason| OpenError::Backend {
        address: address.to_owned(),
        reason: explain(&reason),
    }
}
