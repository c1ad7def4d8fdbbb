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

    /// Publishes what `encode` writes.
    pub fn publish(&mut self, encode: impl FnOnce(&mut Writer)) -> Result<(), SendError> {
        self.writer.clear();
        encode(&mut self.writer);
        self.send()
    }

    /// How many subscribers there are.
    pub fn peers(&self) -> usize {
        self.port.peers()
    }

    fn send(&mut self) -> Result<(), SendError> {
        self.sequence += 1;
        let header = Header {
            type_hash: self.operation.type_hash,
            sequence: self.sequence,
            sent: now(),
        };
        self.port.publish(header, self.writer.finish()?)
    }
}

/// The calling end of a connection.
pub struct Caller {
    port: Box<dyn Client>,
    writer: Writer,
    reply: Vec<u8>,
    id: RequestId,
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

    /// One way: `Ok` means that a live server has it in its queue.
    pub fn command(
        &mut self,
        operation: &Operation,
        encode: impl FnOnce(&mut Writer),
    ) -> Result<(), CallError> {
        let header = self.begin(operation);
        encode(&mut self.writer);
        self.port.send(header, self.writer.finish()?)
    }

    /// There and back. `decode` gets 0 for a result or the hash of an exception, and the bytes of it.
    pub fn query<R>(
        &mut self,
        operation: &Operation,
        encode: impl FnOnce(&mut Writer),
        decode: impl FnOnce(i32, &mut Reader<'_>) -> Result<R, DecodeError>,
    ) -> Result<R, CallError> {
        let header = self.begin(operation);
        encode(&mut self.writer);
        self.exchange(header)?;
        let mut reader = Reader::new(&self.reply);
        match rpc::open_reply(&mut reader, operation.id)? {
            (id, _) if id != self.id => Err(DecodeError::Unknown("request in the reply").into()),
            (_, ReplyKind::Refused(reason)) => Err(CallError::Refused(reason)),
            (_, ReplyKind::Case(case)) => Ok(decode(case, &mut reader)?),
        }
    }

    fn begin(&mut self, operation: &Operation) -> Header {
        self.id.sequence += 1;
        self.writer.clear();
        rpc::begin_request(&mut self.writer, self.id, operation.id);
        Header {
            type_hash: operation.type_hash,
            sequence: self.id.sequence,
            sent: now(),
        }
    }

    fn exchange(&mut self, header: Header) -> Result<(), CallError> {
        self.port
            .call(header, self.writer.finish()?, self.timeout, &mut self.reply)
    }
}

/// A request while it is being answered.
pub struct Request<'a> {
    /// Which operation is asked for, the hash of its name.
    pub operation: i32,
    /// The bytes of its parameters.
    pub reader: Reader<'a>,
    id: RequestId,
    type_hash: u64,
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
            writer,
        })
    }

    /// Whether the sender's types of `operation` are ours; a stranger (0) is trusted to have looked.
    pub fn same_types(&self, operation: &Operation) -> bool {
        self.type_hash == 0 || self.type_hash == operation.type_hash
    }

    /// Answers with what `encode` writes; `case` is 0 for a result, else the hash of an exception. An answer
    /// that cannot be written becomes a refusal that says so, and is returned.
    pub fn answer(
        &mut self,
        case: i32,
        encode: impl FnOnce(&mut Writer),
    ) -> Result<(), HandlerError> {
        self.writer.clear();
        rpc::begin_reply(&mut self.writer, self.id, self.operation, case);
        encode(&mut self.writer);
        match self.writer.finish() {
            Ok(_) => Ok(()),
            Err(error) => {
                let reason = format!("the answer cannot be sent: {error}");
                self.refuse(Outcome::UnknownException, &reason);
                Err(HandlerError(reason))
            }
        }
    }

    /// Answers that, and why, nothing was executed.
    pub fn refuse(&mut self, outcome: Outcome, reason: &str) {
        self.writer.clear();
        rpc::refuse(&mut self.writer, self.id, outcome, reason);
    }

    /// Hands the answer over.
    pub fn close(self, reply: &mut Vec<u8>) {
        *reply = self.writer.into_bytes();
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
