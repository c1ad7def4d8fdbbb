//! The layer between generated code and the bytes of a backend. Only this layer and generated code know codecs.

use crate::backend::{Client, Profile, Publisher, Reply};
use crate::cdr::{Cdr, DecodeError, EncodeError, Reader, Writer};
use crate::counter::Counter;
use crate::error::{CallError, SendError};
use crate::header::{Encoding, Header, now};
use crate::in_place::{self, BEHIND_ENVELOPE, InPlace, Loan, Memory, Sending};
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
    /// What an answer may be where the operation throws, in the order of [`Profile::Ros`]: its exceptions, as it names
    /// them, and then its result. Empty where it throws nothing.
    pub replies: &'static [ReplyVariant],
}

/// One of the things that an answer may be. A result of several parts is several, all with the case 0.
#[derive(Clone, Copy, Debug)]
pub struct ReplyVariant {
    /// 0 for the result, else the hash of the exception.
    pub case: i32,
    /// Writes its default.
    pub put: fn(&mut Writer<'_>),
    /// Reads it and forgets it.
    pub skip: fn(&mut Reader<'_>) -> Result<(), DecodeError>,
}

impl ReplyVariant {
    /// The exception `T`, or, with 0, a part of the result.
    pub const fn of<T: Cdr + Default>(case: i32) -> Self {
        Self {
            case,
            put: |writer| writer.put(&T::default()),
            skip: |reader| reader.get::<T>().map(drop),
        }
    }
}

impl PartialEq for ReplyVariant {
    fn eq(&self, other: &Self) -> bool {
        self.case == other.case
    }
}

impl Eq for ReplyVariant {}

/// The code of an answer in [`Profile::Ros`]: 0 for the result, else the number of the exception, from 1.
fn code(replies: &[ReplyVariant], case: i32) -> i32 {
    let at = replies.iter().position(|a| a.case == case && case != 0);
    at.map_or(0, |at| i32::try_from(at + 1).unwrap_or(i32::MAX))
}

/// The sending end of a topic.
pub struct TypedPublisher {
    port: Box<dyn Publisher>,
    operation: Operation,
    writer: Writer<'static>,
    sent: Counter,
}

impl TypedPublisher {
    /// Sends the values of `operation` through `port`.
    pub fn new(port: Box<dyn Publisher>, operation: Operation) -> Self {
        Self {
            port,
            operation,
            writer: Writer::default(),
            sent: Counter::default(),
        }
    }

    /// How many values it has sent.
    pub fn sent(&self) -> &Counter {
        &self.sent
    }

    /// Begins a value; what is put into the writer is sent by `publish`.
    pub fn begin(&mut self) -> &mut Writer<'static> {
        self.writer.clear();
        &mut self.writer
    }

    /// Sends the value that was begun.
    pub fn publish(&mut self) -> Result<(), SendError> {
        // What cannot be written takes no number: subscribers would count it as lost.
        let body = self.writer.finish()?;
        let header = Header {
            type_hash: self.operation.type_hash,
            sequence: self.sent.next(),
            sent: now(),
            ..Header::default()
        };
        self.port.publish(header, body)
    }

    /// Sends one sample, which `write` serializes. Large arrays are written straight into memory of the
    /// middleware, which takes a second pass: `write` must write the same each time.
    pub fn publish_with(&mut self, write: impl Fn(&mut Writer<'_>)) -> Result<(), SendError> {
        if self.port.can_loan(Encoding::Cdr) {
            self.writer.measure();
        } else {
            self.writer.clear();
        }
        write(&mut self.writer);
        if !self.writer.has_skipped() {
            return self.publish();
        }
        let length = self.writer.len();
        self.writer.finish()?;
        let mut loan = self.port.loan(length)?;
        fill(loan.memory_mut(), write)?;
        loan.send(Header {
            type_hash: self.operation.type_hash,
            sequence: self.sent.next(),
            sent: now(),
            ..Header::default()
        })
    }

    /// Begins a value that is written in place; what is dropped without being sent is not sent.
    pub fn loan<T: InPlace>(&mut self) -> Result<Loan<'_, T>, SendError> {
        let send = Sending {
            type_hash: self.operation.type_hash,
            sent: &self.sent,
            writer: &mut self.writer,
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

    /// How many subscribers there are.
    pub fn peers(&self) -> usize {
        self.port.peers()
    }
}

impl<T: InPlace> Loan<'_, T> {
    /// Sends it. Where there is no shared memory it is copied now.
    pub fn send(self) -> Result<(), SendError> {
        self.check().map_err(unsendable)?;
        let Sending {
            type_hash,
            sent: counter,
            writer,
        } = self.send;
        // What cannot be sent takes no number: nobody is to miss it.
        let header = |encoding| Header {
            type_hash,
            sequence: counter.next(),
            sent: now(),
            encoding,
            ..Header::default()
        };
        match self.memory {
            Memory::Shared(loan) => loan.send(header(Encoding::Image)),
            Memory::Copied(value, port) => {
                writer.clear();
                writer.put(&value.value().map_err(unsendable)?);
                let body = writer.finish()?;
                port.publish(header(Encoding::Cdr), body)
            }
        }
    }
}

/// Lets `write` serialize a body that fills `memory` exactly.
fn fill(memory: &mut [u8], write: impl Fn(&mut Writer<'_>)) -> Result<(), EncodeError> {
    let length = memory.len();
    let mut writer = Writer::into_memory(memory);
    write(&mut writer);
    if writer.finish()?.len() == length {
        Ok(())
    } else {
        Err(EncodeError::NoMemory(length))
    }
}

/// Why a value in place cannot be sent.
fn unsendable(error: DecodeError) -> EncodeError {
    match error {
        DecodeError::OutOfRange { what, value, range } => {
            EncodeError::OutOfRange { what, value, range }
        }
        DecodeError::Invalid(error) => error,
        other => EncodeError::NoValue(other.to_string()),
    }
}

/// The calling end of a connection.
pub struct TypedClient {
    port: Box<dyn Client>,
    writer: Writer<'static>,
    reply: Vec<u8>,
    id: RequestId,
    operation: i32,
    type_hash: u64,
    replies: &'static [ReplyVariant],
    timeout: Duration,
    sent: Counter,
}

impl TypedClient {
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
            replies: &[],
            timeout,
            sent: Counter::default(),
        }
    }

    /// How many calls and commands it has begun.
    pub fn sent(&self) -> &Counter {
        &self.sent
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
    pub fn begin(&mut self, operation: &Operation) -> &mut Writer<'static> {
        self.id.sequence = self.sent.next();
        self.writer.clear();
        self.operation = operation.id;
        self.type_hash = operation.type_hash;
        self.replies = operation.replies;
        rpc::begin_request(&mut self.writer, self.id, operation.id);
        rpc::begin_body(&mut self.writer, self.port.profile());
        &mut self.writer
    }

    /// One way: `Ok` means that a live server has it in its queue.
    pub fn send(&mut self) -> Result<(), CallError> {
        let header = self.header();
        self.port.send(header, self.writer.finish()?)
    }

    /// There and back: 0 for a result or the hash of an exception, and the bytes of it.
    pub fn call(&mut self) -> Result<(i32, Reader<'_>), CallError> {
        let (header, asked) = (self.header(), self.asked());
        let (reply, mut answered) = (&mut self.reply, Header::default());
        self.port.call(
            header,
            self.writer.finish()?,
            self.timeout,
            &mut |header, body| {
                reply.clear();
                reply.extend_from_slice(body);
                answered = header;
            },
        )?;
        open(&self.reply, answered, asked)
    }

    /// The same; the answer is read where the server wrote it, by `read`.
    pub fn call_in_place<T, E: From<CallError>>(
        &mut self,
        read: impl FnOnce(i32, &mut Reader<'_>) -> Result<T, E>,
    ) -> Result<T, E> {
        let (header, asked) = (self.header(), self.asked());
        let (mut read, mut outcome) = (Some(read), None);
        let request = self.writer.finish().map_err(CallError::from)?;
        self.port
            .call(header, request, self.timeout, &mut |header, body| {
                if let Some(read) = read.take() {
                    outcome = Some(match open(body, header, asked) {
                        Ok((case, mut reader)) => read(case, &mut reader),
                        Err(error) => Err(error.into()),
                    });
                }
            })?;
        outcome.unwrap_or_else(|| Err(CallError::from(DecodeError::Truncated(0)).into()))
    }

    /// Sends a command, whose parameters `write` serializes. `Ok` means that the queue of a live server
    /// holds it.
    pub fn send_with(
        &mut self,
        operation: &Operation,
        write: impl Fn(&mut Writer<'_>),
    ) -> Result<(), CallError> {
        write(self.begin(operation));
        self.send()
    }

    /// Calls `operation`. `write` serializes the parameters. `read` gets 0 for a result or the hash of an
    /// exception, and reads the reply in the memory of the middleware.
    pub fn call_with<T, E: From<CallError>>(
        &mut self,
        operation: &Operation,
        write: impl Fn(&mut Writer<'_>),
        read: impl FnOnce(i32, &mut Reader<'_>) -> Result<T, E>,
    ) -> Result<T, E> {
        write(self.begin(operation));
        self.call_in_place(read)
    }

    fn asked(&self) -> Asked {
        Asked {
            id: self.id,
            operation: self.operation,
            type_hash: self.type_hash,
            profile: self.port.profile(),
            replies: self.replies,
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

/// What an answer answers.
#[derive(Clone, Copy)]
struct Asked {
    id: RequestId,
    operation: i32,
    type_hash: u64,
    profile: Profile,
    replies: &'static [ReplyVariant],
}

/// Opens the envelope of a reply.
fn open(body: &[u8], header: Header, asked: Asked) -> Result<(i32, Reader<'_>), CallError> {
    let mut reader = Reader::new(body);
    match rpc::open_reply(&mut reader, asked.operation)? {
        (id, _) if id != asked.id => Err(DecodeError::Unknown("request in the reply").into()),
        (_, ReplyKind::Refused(reason)) => Err(CallError::Refused(reason)),
        (_, ReplyKind::Case(case)) => {
            if header.encoding == Encoding::Image {
                // What is in memory is believed only of an end whose types are the same.
                if header.type_hash != asked.type_hash {
                    return Err(DecodeError::Unknown("type in the reply").into());
                }
                reader.image_at(BEHIND_ENVELOPE);
            }
            if asked.profile == Profile::Ros {
                rpc::open_body(&mut reader, asked.profile);
                let case = open_answer(&mut reader, asked.replies)?;
                return Ok((case, reader));
            }
            Ok((case, reader))
        }
    }
}

/// Goes to what an answer in [`Profile::Ros`] is, and says which of the `answers` that is.
fn open_answer(reader: &mut Reader<'_>, replies: &[ReplyVariant]) -> Result<i32, DecodeError> {
    if replies.is_empty() {
        return Ok(0);
    }
    let found: i32 = reader.get()?;
    for answer in replies.iter().filter(|answer| answer.case != 0) {
        if code(replies, answer.case) == found {
            return Ok(answer.case);
        }
        (answer.skip)(reader)?;
    }
    match found {
        0 => Ok(0),
        _ => Err(DecodeError::Unknown("code in the reply")),
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
    replies: &'static [ReplyVariant],
    /// What comes behind the part of the answer that is being written.
    rest: &'static [ReplyVariant],
    writer: Writer<'static>,
    reply: &'a mut dyn Reply,
    placed: Option<Result<(), EncodeError>>,
}

impl<'a> Request<'a> {
    /// Opens the envelope of `body`; the answer is written into `reply`. Fails where there is no envelope.
    pub fn open(
        header: Header,
        body: &'a [u8],
        reply: &'a mut dyn Reply,
    ) -> Result<Self, DecodeError> {
        let mut reader = Reader::of(body, header.encoding);
        let (id, operation) = rpc::open_request(&mut reader)?;
        rpc::open_body(&mut reader, reply.profile());
        let writer = Writer::over(std::mem::take(reply.body()));
        Ok(Self {
            operation,
            reader,
            id,
            type_hash: header.type_hash,
            two_way: true,
            replies: &[],
            rest: &[],
            writer,
            reply,
            placed: None,
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
        self.replies = operation.replies;
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
    pub fn begin(&mut self, case: i32) -> &mut Writer<'static> {
        self.writer.clear();
        rpc::begin_reply(&mut self.writer, self.id, self.operation, case);
        if self.reply.profile() == Profile::Ros {
            self.begin_answer(case);
        }
        &mut self.writer
    }

    /// Writes what comes before the answer `case` in [`Profile::Ros`].
    fn begin_answer(&mut self, case: i32) {
        rpc::begin_body(&mut self.writer, Profile::Ros);
        self.rest = &[];
        let replies = self.replies;
        if replies.is_empty() {
            return;
        }
        self.writer.put(&code(replies, case));
        let here = replies.iter().position(|answer| answer.case == case);
        for answer in &replies[..here.unwrap_or(replies.len())] {
            (answer.put)(&mut self.writer);
        }
        if let Some(at) = here.filter(|_| case != 0) {
            self.rest = &replies[at + 1..];
        }
    }

    /// Replies with what `write` serializes; `case` is 0 for a result, else the hash of an exception.
    /// Large arrays are written straight into memory of the middleware, which takes a second pass:
    /// `write` must write the same each time.
    pub fn reply_with(
        &mut self,
        case: i32,
        write: impl Fn(&mut Writer<'_>),
    ) -> Result<(), HandlerError> {
        if self.reply.profile() == Profile::Rpc {
            let (id, operation) = (self.id, self.operation);
            let whole = |writer: &mut Writer<'_>| {
                rpc::begin_reply(writer, id, operation, case);
                write(writer);
            };
            self.writer.measure();
            whole(&mut self.writer);
            if !self.writer.has_skipped() {
                return self.finish();
            }
            let length = self.writer.len();
            if let Err(error) = self.writer.finish().map(drop) {
                return self.finished(Err(error));
            }
            if let Some(memory) = self.reply.loan(length, Encoding::Cdr) {
                let filled = fill(memory, whole);
                if filled.is_ok() {
                    self.reply.send_loan();
                }
                return self.finished(filled);
            }
        }
        write(self.begin(case));
        self.finish()
    }

    /// Ends the answer. One that cannot be written becomes a refusal that says so.
    pub fn finish(&mut self) -> Result<(), HandlerError> {
        for answer in std::mem::take(&mut self.rest) {
            (answer.put)(&mut self.writer);
        }
        let written = self.writer.finish().map(|_| ());
        self.finished(written)
    }

    fn finished(&mut self, written: Result<(), EncodeError>) -> Result<(), HandlerError> {
        written.or_else(|error| {
            self.refuse(
                Outcome::UnknownException,
                format!("the answer cannot be sent: {error}"),
            )
        })
    }

    /// Lets `fill` write the result in place; [`Request::finish_in_place`] sends it. Where there is no shared memory
    /// it is copied.
    pub fn in_place<T: InPlace, R>(
        &mut self,
        fill: impl FnOnce(&mut T) -> R,
    ) -> Result<R, HandlerError> {
        // A stranger, who proves no types, gets CDR.
        let length = BEHIND_ENVELOPE + size_of::<T>();
        let memory = if self.type_hash == 0 {
            None
        } else {
            self.reply.loan(length, Encoding::Image)
        };
        if let Some(memory) = memory {
            let (envelope, image) = memory.split_at_mut(BEHIND_ENVELOPE.min(memory.len()));
            if let Some(value) = in_place::over::<T>(image) {
                value.reset();
                let outcome = fill(value);
                self.placed = Some(value.check().map_err(unsendable));
                self.writer.clear();
                rpc::begin_reply(&mut self.writer, self.id, self.operation, 0);
                let begin = self.writer.finish().unwrap_or_default();
                envelope.fill(0);
                envelope[..begin.len()].copy_from_slice(begin);
                return Ok(outcome);
            }
        }
        let mut value = match in_place::boxed::<T>() {
            Ok(value) => value,
            Err(error) => return self.refuse(Outcome::OutOfResources, error.to_string()),
        };
        let outcome = fill(&mut value);
        let writer = self.begin(0);
        match value.check().and_then(|()| value.value()) {
            Ok(value) => writer.put(&value),
            Err(error) => writer.fail(unsendable(error)),
        }
        Ok(outcome)
    }

    /// Ends an answer that was written in place.
    pub fn finish_in_place(&mut self) -> Result<(), HandlerError> {
        match self.placed.take() {
            Some(Ok(())) => {
                self.reply.send_loan();
                Ok(())
            }
            Some(Err(error)) => self.finished(Err(error)),
            None => self.finish(),
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
    pub fn close(self) {
        let reply = self.reply.body();
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
