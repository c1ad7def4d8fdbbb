//! Publishes the samples of one operation, as CDR or in place.

use super::{Gate, Operation, Put, fill, unsendable};
use crate::backend::{ImageEncoder, LoanedSample, Publisher};
use crate::cdr::{EncodeError, Reader, Writer};
use crate::counter::Counter;
use crate::error::SendError;
use crate::header::{Encoding, Header, now};
use crate::in_place::{self, InPlace, Loan, Memory, Sending};
use crate::shared_value::SharedValue;

/// Publishes the samples of one operation.
///
/// ```no_run
/// use rc_middleware::typed::{Operation, TypedPublisher};
/// use rc_middleware::{Publisher, SendError};
///
/// # fn publish(port: Box<dyn Publisher>, operation: Operation) -> Result<(), SendError> {
/// let mut topic = TypedPublisher::new(port, operation);
/// topic.publish_parts((&42_i32,))?;
/// assert_eq!(topic.sent().get(), 1);
/// # Ok(())
/// # }
/// ```
pub struct TypedPublisher {
    port: Box<dyn Publisher>,
    operation: Operation,
    writer: Writer<'static>,
    sent: Counter,
    gate: Gate,
    withheld: Counter,
}

impl TypedPublisher {
    /// Publishes samples of `operation` through `port`.
    pub fn new(port: Box<dyn Publisher>, operation: Operation) -> Self {
        Self {
            port,
            operation,
            writer: Writer::default(),
            sent: Counter::default(),
            gate: Gate::default(),
            withheld: Counter::default(),
        }
    }

    /// Sends samples only while `gate` is open.
    #[must_use]
    pub fn behind(self, gate: Gate) -> Self {
        Self { gate, ..self }
    }

    /// The number of samples that were not sent because the gate was closed.
    pub fn withheld(&self) -> &Counter {
        &self.withheld
    }

    /// The number of sent samples.
    pub fn sent(&self) -> &Counter {
        &self.sent
    }

    /// Sends one sample, which `write` serializes. Large arrays are written straight into memory of
    /// the middleware, which takes a second pass: `write` must write the same each time.
    ///
    /// Subscribers count a sample as lost if it can be encoded and its sending fails. A sample that
    /// cannot be encoded takes no sequence number. While the gate is closed, nothing is sent, which
    /// is not an error.
    pub fn publish_with(&mut self, write: impl Fn(&mut Writer<'_>)) -> Result<(), SendError> {
        self.forward_with(0, write)
    }

    /// Sends one sample that is a body of CDR, which the caller has checked against its type.
    pub fn publish_body(&mut self, body: &[u8]) -> Result<(), SendError> {
        if !self.gate.is_open() {
            self.withheld.next();
            return Ok(());
        }
        let header = header(&self.operation, &self.sent, 0);
        self.port.publish(header, body)
    }

    /// [`TypedPublisher::publish_with`] for a sample that another publisher sent at `sent`, by
    /// [`Header::sent`], so that it keeps its age; 0 means now.
    pub fn forward_with(
        &mut self,
        sent: u64,
        write: impl Fn(&mut Writer<'_>),
    ) -> Result<(), SendError> {
        if !self.gate.is_open() {
            self.withheld.next();
            return Ok(());
        }
        if self.port.can_loan(Encoding::Cdr) {
            self.writer.measure();
        } else {
            self.writer.clear();
        }
        write(&mut self.writer);
        if !self.writer.has_skipped() {
            let body = self.writer.finish()?;
            let header = header(&self.operation, &self.sent, sent);
            return self.port.publish(header, body);
        }
        let length = self.writer.len();
        self.writer.finish()?;
        let mut loan = match self.port.loan(length) {
            Ok(loan) => loan,
            Err(error) => {
                // The sample could be encoded, so it counts as lost.
                self.sent.next();
                return Err(error);
            }
        };
        fill(loan.memory_mut(), write)?;
        loan.send(header(&self.operation, &self.sent, sent))
    }

    /// Sends one sample of these parameters, as [`TypedPublisher::publish_with`]. Subscribers in
    /// this process get them as a value without encoding.
    pub fn publish_parts(&mut self, parameters: impl Put) -> Result<(), SendError> {
        if !self.port.takes_values() {
            return self.publish_with(|writer| parameters.put(writer));
        }
        if !self.gate.is_open() {
            self.withheld.next();
            return Ok(());
        }
        let value = SharedValue::of(parameters)?;
        let header = header(&self.operation, &self.sent, 0);
        self.port.publish_value(header, value)
    }

    /// Begins a sample that is written in place. Dropping the loan without sending it discards it.
    pub fn loan<T: InPlace>(&mut self) -> Result<Loan<'_, T>, SendError> {
        let send = Sending {
            type_hash: self.operation.type_hash,
            sent: &self.sent,
            writer: &mut self.writer,
            withheld: (!self.gate.is_open()).then_some(&self.withheld),
        };
        if !self.port.can_loan(Encoding::Image) {
            let memory = Memory::Copied(in_place::boxed()?, &mut *self.port);
            return Ok(Loan { memory, send });
        }
        let mut loan = self.port.loan(size_of::<T>())?;
        match in_place::over::<T>(loan.memory_mut()) {
            Some(value) => value.reset(),
            None => return Err(EncodeError::NoMemory(size_of::<T>()).into()),
        }
        let memory = Memory::Shared(loan);
        Ok(Loan { memory, send })
    }

    /// Lends memory for an image of `length` bytes whose type is known at run time. `None` if the
    /// middleware lends none. [`TypedPublisher::send_image`] sends it.
    pub fn loan_image(
        &mut self,
        length: usize,
    ) -> Result<Option<Box<dyn LoanedSample>>, SendError> {
        self.port.loan_image(length)
    }

    /// Sends an image that [`TypedPublisher::loan_image`] lent and that is a value of its type.
    /// Subscribers over a middleware that carries no images get what `encode` makes of it.
    pub fn send_image(
        &mut self,
        loan: Box<dyn LoanedSample>,
        encode: ImageEncoder<'_>,
    ) -> Result<(), SendError> {
        self.forward_image(0, loan, encode)
    }

    /// [`TypedPublisher::send_image`] with `sent` as for [`TypedPublisher::forward_with`].
    pub fn forward_image(
        &mut self,
        sent: u64,
        loan: Box<dyn LoanedSample>,
        encode: ImageEncoder<'_>,
    ) -> Result<(), SendError> {
        if !self.gate.is_open() {
            self.withheld.next();
            return Ok(());
        }
        let header = Header {
            encoding: Encoding::Image,
            ..header(&self.operation, &self.sent, sent)
        };
        self.port.send_lent(loan, header, encode)
    }

    /// The number of subscribers.
    pub fn peers(&self) -> usize {
        self.port.peers()
    }
}

/// The header of the next sample. `sent`: when it was sent; 0 means now.
fn header(operation: &Operation, counter: &Counter, sent: u64) -> Header {
    Header {
        type_hash: operation.type_hash,
        sequence: counter.next(),
        sent: if sent == 0 { now() } else { sent },
        ..Header::default()
    }
}

impl<T: InPlace> Loan<'_, T> {
    /// Sends the sample. Without shared memory it is copied now.
    pub fn send(self) -> Result<(), SendError> {
        self.check().map_err(unsendable)?;
        let Sending {
            type_hash,
            sent: counter,
            writer,
            withheld,
        } = self.send;
        if let Some(withheld) = withheld {
            withheld.next();
            return Ok(());
        }
        // A sample that cannot be encoded takes no sequence number: subscribers would count it as
        // lost.
        let header = |encoding| Header {
            type_hash,
            sequence: counter.next(),
            sent: now(),
            encoding,
            ..Header::default()
        };
        match self.memory {
            Memory::Shared(loan) => loan.send_image(header(Encoding::Image), &encoded::<T>),
            Memory::Copied(value, port) => {
                writer.clear();
                writer.put(&value.value().map_err(unsendable)?);
                let body = writer.finish()?;
                port.publish(header(Encoding::Cdr), body)
            }
        }
    }
}

/// The CDR of an image, which was checked.
fn encoded<T: InPlace>(image: &[u8]) -> Result<Vec<u8>, EncodeError> {
    let value = Reader::of(image, Encoding::Image).value::<T>();
    let mut writer = Writer::default();
    writer.put(&value.map_err(unsendable)?);
    writer.finish()?;
    Ok(writer.into_bytes())
}
