//! The publisher of a topic.

use crate::port::{EndpointSpec, Opening, WriterPort};
use crate::{Session, stamp};
use rc_middleware::{Header, OpenError, Publisher, SendError};
use std::rc::Rc;
use std::sync::Arc;

/// The publisher of a topic.
pub struct TopicPublisher {
    port: WriterPort,
    address: String,
}

impl TopicPublisher {
    /// Opens the publisher at `address`.
    pub fn open(
        session: &Rc<Session>,
        address: &str,
        spec: EndpointSpec<'_>,
    ) -> Result<Self, OpenError> {
        let opening = Opening::begin(session, address)?;
        let port = opening.writer(spec, Arc::new(()))?;
        opening.meet(&[port.state()]);
        Ok(Self {
            port,
            address: address.to_owned(),
        })
    }

    /// Its endpoint.
    pub fn port(&self) -> &WriterPort {
        &self.port
    }
}

impl Publisher for TopicPublisher {
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
