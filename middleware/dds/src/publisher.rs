//! The publisher of a topic.

use crate::names;
use crate::port::{EndpointSpec, Opening, WriterPort, signal};
use crate::qos::topic_qos;
use crate::session::Session;
use rc_middleware::{Endpoint, Header, OpenError, Publisher, SendError};
use rc_network::{Role, stamp};
use std::rc::Rc;

pub(crate) fn open(session: &Rc<Session>, endpoint: &Endpoint) -> Result<DdsPublisher, OpenError> {
    let address = endpoint.address.to_string();
    let opening = Opening::begin(session, &address)?;
    let port = opening.writer(EndpointSpec {
        names: names::topic(endpoint),
        role: Role::Publisher,
        types: &endpoint.types,
        qos: topic_qos(&endpoint.qos),
        signal: signal(&address)?,
    })?;
    opening.meet(&[port.state()]);
    Ok(DdsPublisher { port, address })
}

pub(crate) struct DdsPublisher {
    port: WriterPort,
    address: String,
}

impl Publisher for DdsPublisher {
    fn publish(&mut self, header: Header, body: &[u8]) -> Result<(), SendError> {
        let writer = &self.port.writer;
        writer
            .write(header.sequence, stamp(header.sent), body)
            .map_err(|error| SendError::Backend {
                address: self.address.clone(),
                reason: error.to_string(),
            })
    }

    fn peers(&self) -> usize {
        self.port.state().count()
    }
}
