//! The publisher of a topic.

use crate::names;
use crate::qos;
use crate::session::{EndpointSpec, Port, Session, Unsent, signal};
use crate::wire::Body;
use rc_middleware::{Endpoint, Header, OpenError, Publisher, SendError};
use rc_network::{EndpointKind, Role, stamp};
use std::rc::Rc;
use std::sync::Arc;

pub(crate) fn open(session: &Rc<Session>, endpoint: &Endpoint) -> Result<RosPublisher, OpenError> {
    let address = endpoint.address.to_string();
    let port = session.end(EndpointSpec {
        address: &address,
        topic: names::topic(endpoint, session.rules())?,
        role: Role::Publisher,
        types: &endpoint.types,
        kind: EndpointKind::Writer,
        qos: qos::topic(&endpoint.qos),
        signal: signal(&address)?,
        is_watched: false,
        inbox: Arc::new(()),
        group: Default::default(),
    })?;
    Ok(RosPublisher { port, address })
}

pub(crate) struct RosPublisher {
    port: Port,
    address: String,
}

impl Publisher for RosPublisher {
    fn publish(&mut self, header: Header, body: &[u8]) -> Result<(), SendError> {
        let failed = |reason: String| SendError::Backend {
            address: self.address.clone(),
            reason,
        };
        let (body, stamp) = (Body::of(&[body]), stamp(header.sent));
        match self.port.send(body, stamp, None, None) {
            Ok(_) => Ok(()),
            // A slow subscriber loses samples, and delays nobody.
            Err(Unsent::Full) => self.port.renew().map_err(failed),
            Err(Unsent::Failed(reason)) => Err(failed(reason)),
        }
    }

    fn peers(&self) -> usize {
        self.port.state.count()
    }
}
