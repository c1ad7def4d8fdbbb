//! The publisher of a topic.

use crate::port::{EndpointSpec, Opening, WriterPort};
use crate::{Session, stamp};
use rc_ddsc::{BEFORE_BODY, Loan};
use rc_middleware::{Encoding, Header, LoanedSample, OpenError, Publisher, SendError};
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

    /// Writer of the samples.
    pub fn port(&self) -> &WriterPort {
        &self.port
    }
}

impl TopicPublisher {
    fn failed(&self, error: rc_ddsc::Error) -> SendError {
        SendError::Backend {
            address: self.address.clone(),
            reason: error.to_string(),
        }
    }
}

impl Publisher for TopicPublisher {
    fn publish(&mut self, header: Header, body: &[u8]) -> Result<(), SendError> {
        let writer = &self.port.writer;
        writer
            .write(header.sequence, stamp(header.sent), body)
            .map_err(|error| self.failed(error))
    }

    /// A sample has an encapsulation and no image.
    fn can_loan(&self, encoding: Encoding) -> bool {
        encoding == Encoding::Cdr
    }

    fn loan(&mut self, length: usize) -> Result<Box<dyn LoanedSample + '_>, SendError> {
        let loan = self.port.writer.loan(length);
        let loan = loan.map_err(|error| self.failed(error))?;
        Ok(Box::new(LentSample {
            publisher: self,
            loan,
        }))
    }

    fn senders(&self) -> Vec<u128> {
        vec![u128::from_be_bytes(self.port.guid)]
    }

    fn peers(&self) -> usize {
        self.port.state().count()
    }
}

/// A sample in memory of the library.
struct LentSample<'a> {
    publisher: &'a TopicPublisher,
    loan: Loan,
}

impl LoanedSample for LentSample<'_> {
    fn memory(&self) -> &[u8] {
        &self.loan.bytes()[BEFORE_BODY..]
    }

    fn memory_mut(&mut self) -> &mut [u8] {
        &mut self.loan.memory()[BEFORE_BODY..]
    }

    fn send(self: Box<Self>, header: Header) -> Result<(), SendError> {
        let Self { publisher, loan } = *self;
        let numbers = (header.sequence, stamp(header.sent));
        let sent = publisher.port.writer.send(loan, numbers, 0, None);
        sent.map_err(|error| publisher.failed(error))
    }
}
