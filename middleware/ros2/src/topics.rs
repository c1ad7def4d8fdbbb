//! Publishers and subscribers: topics of ROS are topics of DDS with other names.

use crate::graph::Listed;
use crate::names;
use crate::node::Node;
use rc_middleware::{
    Endpoint, Header, OpenError, Publisher, QueueGauge, ReceiveError, SendError, Subscriber,
};
use rc_network::{EndpointSpec, Role, TopicPublisher, TopicSubscriber, signal};
use std::os::fd::BorrowedFd;

fn spec<'a>(
    node: &Node,
    endpoint: &'a Endpoint,
    role: Role,
) -> Result<EndpointSpec<'a>, OpenError> {
    let external = endpoint.external_types.first();
    Ok(EndpointSpec {
        names: names::topic(endpoint, &node.rules)?,
        role,
        types: &endpoint.types,
        qos: Some(endpoint.qos),
        signal: signal(endpoint.address.as_str())?,
        labels: external.map_or_else(String::new, |e| node.types.labels(&e.type_name)),
    })
}

/// A publisher that is listed in the graph.
pub(crate) struct RosPublisher {
    publisher: TopicPublisher,
    _listed: Listed,
}

pub(crate) fn publisher(node: &Node, endpoint: &Endpoint) -> Result<RosPublisher, OpenError> {
    let spec = spec(node, endpoint, Role::Publisher)?;
    let address = endpoint.address.as_str();
    let publisher = TopicPublisher::open(&node.session, address, spec)?;
    Ok(RosPublisher {
        _listed: node.graph.list(&[], &[publisher.port().guid]),
        publisher,
    })
}

impl Publisher for RosPublisher {
    fn publish(&mut self, header: Header, body: &[u8]) -> Result<(), SendError> {
        self.publisher.publish(header, body)
    }

    fn senders(&self) -> Vec<u128> {
        self.publisher.senders()
    }

    fn peers(&self) -> usize {
        self.publisher.peers()
    }
}

/// A subscriber that is listed in the graph.
pub(crate) struct RosSubscriber {
    subscriber: TopicSubscriber,
    _listed: Listed,
}

pub(crate) fn subscriber(node: &Node, endpoint: &Endpoint) -> Result<RosSubscriber, OpenError> {
    let spec = spec(node, endpoint, Role::Subscriber)?;
    let (address, depth) = (endpoint.address.as_str(), endpoint.qos.depth);
    let subscriber = TopicSubscriber::open(&node.session, address, spec, depth)?;
    Ok(RosSubscriber {
        _listed: node.graph.list(&[subscriber.port().guid], &[]),
        subscriber,
    })
}

impl Subscriber for RosSubscriber {
    fn descriptor(&self) -> BorrowedFd<'_> {
        self.subscriber.descriptor()
    }

    fn acknowledge(&mut self, woken: bool) {
        self.subscriber.acknowledge(woken);
    }

    fn receive(&mut self, take: &mut dyn FnMut(Header, &[u8])) -> Result<bool, ReceiveError> {
        self.subscriber.receive(take)
    }

    fn peers(&self) -> usize {
        self.subscriber.peers()
    }

    fn queue(&self) -> Option<QueueGauge> {
        self.subscriber.queue()
    }
}
