//! The sending end of a topic.

use crate::qos::topic_qos;
use crate::session::{EndpointSpec, Port, Session};
use rc_middleware::{Endpoint, Header, OpenError, Publisher, SendError, WakeEvent};
use rc_network::{Role, stamp};
use std::rc::Rc;
use std::sync::Arc;

/// The name of the type of a topic in DDS: `Module::Interface_operation`.
pub(crate) fn type_name(endpoint: &Endpoint) -> String {
    endpoint.types.name.replace('/', "_")
}

pub(crate) fn open(session: &Rc<Session>, endpoint: &Endpoint) -> Result<DdsPublisher, OpenError> {
    let address = endpoint.address.to_string();
    let [port] = session.ports([EndpointSpec {
        address: &address,
        topic: address.clone(),
        type_name: type_name(endpoint),
        role: Role::Publisher,
        types: &endpoint.types,
        sends: true,
        qos: topic_qos(&endpoint.qos),
        signal: signal(&address)?,
        inbox: Arc::new(()),
    }])?;
    Ok(DdsPublisher { port, address })
}

pub(crate) fn signal(address: &str) -> Result<WakeEvent, OpenError> {
    WakeEvent::new().map_err(|error| OpenError::Backend {
        address: address.to_owned(),
        reason: error.to_string(),
    })
}

pub(crate) struct DdsPublisher {
    port: Port,
    address: String,
}

impl Publisher for DdsPublisher {
    fn publish(&mut self, header: Header, body: &[u8]) -> Result<(), SendError> {
        let entity = &self.port.entity;
        entity
            .write(header.sequence, stamp(header.sent), body)
            .map_err(|error| SendError::Backend {
                address: self.address.clone(),
                reason: error.to_string(),
            })
    }

    fn peers(&self) -> usize {
        self.port.state.count()
    }
}
