//! The types of services, ports and messages of iceoryx2 as this crate uses them.

use crate::message::{MessageHeader, RequestHeader};
use iceoryx2::port::{client, listener, notifier, publisher, server, subscriber};
use iceoryx2::service::port_factory::{event, publish_subscribe, request_response};

pub(crate) use crate::variant::Service;

pub(crate) type Node = iceoryx2::prelude::Node<Service>;
pub(crate) type EventService = event::PortFactory<Service>;
pub(crate) type ListenerPort = listener::Listener<Service>;
pub(crate) type NotifierPort = notifier::Notifier<Service>;
pub(crate) type TopicService = publish_subscribe::PortFactory<Service, [u8], MessageHeader>;
pub(crate) type PublisherPort = publisher::Publisher<Service, [u8], MessageHeader>;
pub(crate) type Received = iceoryx2::sample::Sample<Service, [u8], MessageHeader>;
pub(crate) type Sample = iceoryx2::sample_mut::SampleMut<Service, [u8], MessageHeader>;
pub(crate) type SubscriberPort = subscriber::Subscriber<Service, [u8], MessageHeader>;
pub(crate) type CallService =
    request_response::PortFactory<Service, [u8], RequestHeader, [u8], MessageHeader>;
pub(crate) type ClientPort = client::Client<Service, [u8], RequestHeader, [u8], MessageHeader>;
pub(crate) type ServerPort = server::Server<Service, [u8], RequestHeader, [u8], MessageHeader>;
pub(crate) type Request =
    iceoryx2::request_mut::RequestMut<Service, [u8], RequestHeader, [u8], MessageHeader>;
pub(crate) type PendingResponse =
    iceoryx2::pending_response::PendingResponse<Service, [u8], RequestHeader, [u8], MessageHeader>;
pub(crate) type Response = iceoryx2::response_mut::ResponseMut<Service, [u8], MessageHeader>;
pub(crate) type ActiveRequest =
    iceoryx2::active_request::ActiveRequest<Service, [u8], RequestHeader, [u8], MessageHeader>;
