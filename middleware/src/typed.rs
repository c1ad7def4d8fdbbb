//! The layer between generated code and the bytes of a backend. Only this layer and generated code know codecs.

use crate::backend::{Client, Header, Publisher, now};
use crate::cdr::{DecodeError, Reader, Writer};
use crate::error::{CallError, SendError};
use crate::rpc::{self, Outcome, ReplyKind, RequestId};
use std::time::Duration;

/// What generated code knows of one operation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Operation {
    /// Its name in the IDSL.
    pub name: &'static str,
    /// The hash of its name, the discriminator of the envelope.
    pub id: i32,
    /// The hash of its types.
    pub type_hash: u64,
    /// Whether an answer comes back.
    pub two_way: bool,
}

/// The sending end of a topic.
pub struct Topic {
    port: Box<dyn Publisher>,
    operation: Operation,
    writer: Writer,
    sequence: u64,
}

impl Topic {
    /// Sends the values of `operation` through `port`.
    pub fn new(port: Box<dyn Publisher>, operation: Operation) -> Self {
        Self {
            port,
            operation,
            writer: Writer::default(),
            sequence: 0,
        }
    }

    /// Begins a value; what is put into the writer is sent by `publish`.
    pub fn begin(&mut self) -> &mut Writer {
        self.writer.clear();
        &mut self.writer
    }

    /// Sends the value that was begun.
    pub fn publish(&mut self) -> Result<(), SendError> {
        // What cannot be written takes no number: subscribers would count it as lost.
        let body = self.writer.finish()?;
        self.sequence += 1;
        let header = Header {
            type_hash: self.operation.type_hash,
            sequence: self.sequence,
            sent: now(),
            ..Header::default()
        };
        self.port.publish(header, body)
    }

    /// How many subscribers there are.
    pub fn peers(&self) -> usize {
        self.port.peers()
    }
}

/// The calling end of a connection.
pub struct Caller {
    port: Box<dyn Client>,
    writer: Writer,
    reply: Vec<u8>,
    id: RequestId,
    operation: i32,
    type_hash: u64,
    timeout: Duration,
}

impl Caller {
    /// Calls through `port`; an answer that takes longer than `timeout` is a `CallError::Deadline`.
    pub fn new(port: Box<dyn Client>, timeout: Duration) -> Self {
        let id = RequestId {
            writer: port.guid(),
            sequence: 0,
        };
        Self {
            port,
            writer: Writer::default(),
            reply: Vec::new(),
            id,
            operation: 0,
            type_hash: 0,
            timeout,
        }
    }

    /// How long a call may take.
    pub fn timeout(&self) -> Duration {
        self.timeout
    }

    /// Sets how long a call may take.
    pub fn set_timeout(&mut self, timeout: Duration) {
        self.timeout = timeout;
    }

    /// Whether a server is there.
    pub fn peers(&self) -> usize {
        self.port.peers()
    }

    /// Begins a call of `operation`; its parameters are put into the writer, then it is sent or called.
    pub fn begin(&mut self, operation: &Operation) -> &mut Writer {
        self.id.sequence += 1;
        self.writer.clear();
        self.operation = operation.id;
        self.type_hash = operation.type_hash;
        rpc::begin_request(&mut self.writer, self.id, operation.id);
        &mut self.writer
    }

    /// One way: `Ok` means that a live server has it in its queue.
    pub fn send(&mut self) -> Result<(), CallError> {
        let header = self.header();
        self.port.send(header, self.writer.finish()?)
    }

    /// There and back: 0 for a result or the hash of an exception, and the bytes of it.
    pub fn call(&mut self) -> Result<(i32, Reader<'_>), CallError> {
        let header = self.header();
        self.port
            .call(header, self.writer.finish()?, self.timeout, &mut self.reply)?;
        let mut reader = Reader::new(&self.reply);
        match rpc::open_reply(&mut reader, self.operation)? {
            (id, _) if id != self.id => Err(DecodeError::Unknown("request in the reply").into()),
            (_, ReplyKind::Refused(reason)) => Err(CallError::Refused(reason)),
            (_, ReplyKind::Case(case)) => Ok((case, reader)),
        }
    }

    fn header(&self) -> Header {
        Header {
            type_hash: self.type_hash,
            sequence: self.id.sequence,
            sent: now(),
            ..Header::default()
        }
    }
}

/// Refuses a reply that is an exception which the operation does not throw.
pub fn expect_result(case: i32) -> Result<(), DecodeError> {
    if case == 0 {
        Ok(())
    } else {
        Err(DecodeError::Unknown("exception in the reply"))
    }
}

/// A request while it is being answered.
pub struct Request<'a> {
    /// Which operation is asked for, the hash of its name.
    pub operation: i32,
    reader: Reader<'a>,
    id: RequestId,
    type_hash: u64,
    two_way: bool,
    writer: Writer,
}

impl<'a> Request<'a> {
    /// Opens the envelope of `body`; the answer is written into `reply`. Fails where there is no envelope.
    pub fn open(header: Header, body: &'a [u8], reply: &mut Vec<u8>) -> Result<Self, DecodeError> {
        let mut reader = Reader::new(body);
        let (id, operation) = rpc::open_request(&mut reader)?;
        reply.clear();
        let writer = Writer::over(std::mem::take(reply));
        Ok(Self {
            operation,
            reader,
            id,
            type_hash: header.type_hash,
            two_way: true,
            writer,
        })
    }

    /// The parameters of `operation`, which `read` reads. Where the sender's types are others or the bytes are
    /// no parameters, the request is refused. A stranger (type hash 0) is trusted to have looked.
    pub fn arguments<T>(
        &mut self,
        operation: &Operation,
        read: impl FnOnce(&mut Reader<'a>) -> Result<T, DecodeError>,
    ) -> Result<T, HandlerError> {
        self.two_way = operation.two_way;
        let what = operation.name;
        if self.type_hash != 0 && self.type_hash != operation.type_hash {
            let (theirs, ours) = (self.type_hash, operation.type_hash);
            let reason = format!(
                "`{what}` has types {theirs:016x} there and {ours:016x} here; regenerate both ends"
            );
            return self.refuse(Outcome::InvalidArgument, reason);
        }
        match read(&mut self.reader) {
            Ok(arguments) => Ok(arguments),
            Err(error) => self.refuse(Outcome::InvalidArgument, format!("`{what}`: {error}")),
        }
    }

    /// Begins the answer; `case` is 0 for a result, else the hash of an exception.
    pub fn begin(&mut self, case: i32) -> &mut Writer {
        self.writer.clear();
        rpc::begin_reply(&mut self.writer, self.id, self.operation, case);
        &mut self.writer
    }

    /// Ends the answer. One that cannot be written becomes a refusal that says so.
    pub fn finish(&mut self) -> Result<(), HandlerError> {
        match self.writer.finish() {
            Ok(_) => Ok(()),
            Err(error) => self.refuse(
                Outcome::UnknownException,
                format!("the answer cannot be sent: {error}"),
            ),
        }
    }

    /// Answers that the handler failed in a way that its operation does not name.
    pub fn fail(&mut self, reason: &dyn std::fmt::Display) -> Result<(), HandlerError> {
        self.refuse(Outcome::UnknownException, reason.to_string())
    }

    /// Answers that the interface has no such operation.
    pub fn unknown(&mut self) -> Result<(), HandlerError> {
        let reason = format!(
            "there is no operation with the hash {:08x} here",
            self.operation
        );
        self.refuse(Outcome::UnknownOperation, reason)
    }

    fn refuse<T>(&mut self, outcome: Outcome, reason: String) -> Result<T, HandlerError> {
        self.writer.clear();
        rpc::refuse(&mut self.writer, self.id, outcome, &reason);
        Err(HandlerError(reason))
    }

    /// Hands the answer over; a command has none.
    pub fn close(self, reply: &mut Vec<u8>) {
        *reply = self.writer.into_bytes();
        if !self.two_way {
            reply.clear();
        }
    }
}

/// Why a message or a request was not handled; logged and counted.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct HandlerError(pub String);

impl From<DecodeError> for HandlerError {
    fn from(error: DecodeError) -> Self {
        Self(error.to_string())
    }
}
