//! Typed publishers, clients and requests: the layer between generated code and the bytes of a
//! backend. Only this layer and generated code know codecs.

use crate::backend::{Client, Profile, Publisher, Reply};
use crate::cdr::{Cdr, DecodeError, EncodeError, Reader, Writer};
use crate::counter::Counter;
use crate::error::{CallError, SendError};
use crate::header::{Encoding, Header, now};
use crate::in_place::{self, BEHIND_ENVELOPE, InPlace, Loan, Memory, Sending};
use crate::rpc::{self, Outcome, ReplyKind, RequestId};
use std::time::Duration;

/// An operation of an interface. Generated code has one constant for each.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Operation {
    /// The name in the IDSL.
    pub name: &'static str,
    /// The hash of the name: the discriminator in the envelope.
    pub id: i32,
    /// The hash of the types.
    pub type_hash: u64,
    /// Whether the operation is a query, which has a reply.
    pub two_way: bool,
    /// The variants of a reply, if the operation throws: its exceptions in the order of their
    /// declaration, and then its result, as [`Profile::Ros`] orders them. Empty if it throws
    /// nothing.
    pub replies: &'static [ReplyVariant],
}

/// A variant of a reply. A result of several parts has one variant for each part, all with case 0.
#[derive(Clone, Copy, Debug)]
pub struct ReplyVariant {
    /// 0 for the result, else the hash of the exception.
    pub case: i32,
    /// Writes the default value.
    pub put: fn(&mut Writer<'_>),
    /// Reads a value and drops it.
    pub skip: fn(&mut Reader<'_>) -> Result<(), DecodeError>,
}

impl ReplyVariant {
    /// The variant of the exception `T`; with case 0, of a part of the result.
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

/// The code of a reply in [`Profile::Ros`]: 0 for the result, else the number of the exception,
/// from 1.
fn code(replies: &[ReplyVariant], case: i32) -> i32 {
    let at = replies.iter().position(|a| a.case == case && case != 0);
    at.map_or(0, |at| i32::try_from(at + 1).unwrap_or(i32::MAX))
}

/// Publishes the samples of one operation.
///
/// ```no_run
/// use rc_middleware::typed::{Operation, TypedPublisher};
/// use rc_middleware::{Publisher, SendError};
///
/// # fn publish(port: Box<dyn Publisher>, operation: Operation) -> Result<(), SendError> {
/// let mut topic = TypedPublisher::new(port, operation);
/// topic.publish_with(|writer| writer.put(&42_i32))?;
/// assert_eq!(topic.sent().get(), 1);
/// # Ok(())
/// # }
/// ```
pub struct TypedPublisher {
    port: Box<dyn Publisher>,
    operation: Operation,
    writer: Writer<'static>,
    sent: Counter,
}

impl TypedPublisher {
    /// Publishes samples of `operation` through `port`.
    pub fn new(port: Box<dyn Publisher>, operation: Operation) -> Self {
        Self {
            port,
            operation,
            writer: Writer::default(),
            sent: Counter::default(),
        }
    }

    /// The number of sent samples.
    pub fn sent(&self) -> &Counter {
        &self.sent
    }

    /// Begins a sample. [`TypedPublisher::publish`] sends what is put into the writer.
    pub fn begin(&mut self) -> &mut Writer<'static> {
        self.writer.clear();
        &mut self.writer
    }

    /// Sends the sample that was begun.
    ///
    /// Subscribers count a sample as lost if it can be encoded and its sending fails. A sample that
    /// cannot be encoded takes no sequence number.
    pub fn publish(&mut self) -> Result<(), SendError> {
        let body = self.writer.finish()?;
        let header = Header {
            type_hash: self.operation.type_hash,
            sequence: self.sent.next(),
            sent: now(),
            ..Header::default()
        };
        self.port.publish(header, body)
    }

    /// Sends one sample, which `write` serializes. Large arrays are written straight into memory of
    /// the middleware, which takes a second pass: `write` must write the same each time. Errors and
    /// sequence numbers are those of [`TypedPublisher::publish`].
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
        let mut loan = match self.port.loan(length) {
            Ok(loan) => loan,
            Err(error) => {
                // The sample is lost, as in `publish`.
                self.sent.next();
                return Err(error);
            }
        };
        fill(loan.memory_mut(), write)?;
        loan.send(Header {
            type_hash: self.operation.type_hash,
            sequence: self.sent.next(),
            sent: now(),
            ..Header::default()
        })
    }

    /// Begins a sample that is written in place. Dropping the loan without sending it discards it.
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

    /// The number of subscribers.
    pub fn peers(&self) -> usize {
        self.port.peers()
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
        } = self.send;
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
        Err(EncodeError::Changed)
    }
}

/// The reason why a value in place cannot be sent.
fn unsendable(error: DecodeError) -> EncodeError {
    match error {
        DecodeError::OutOfRange { what, value, range } => {
            EncodeError::OutOfRange { what, value, range }
        }
        DecodeError::Invalid(error) => error,
        other => EncodeError::NoValue(other.to_string()),
    }
}

/// Calls the operations of one interface.
///
/// ```no_run
/// use rc_middleware::typed::{Operation, TypedClient, expect_result};
/// use rc_middleware::{CallError, Client};
/// use std::time::Duration;
///
/// # fn ask(port: Box<dyn Client>, double: &Operation) -> Result<i32, CallError> {
/// let mut client = TypedClient::new(port, Duration::from_secs(1));
/// client.call_with(
///     double,
///     |writer| writer.put(&21_i32),
///     |case, reader| {
///         expect_result(case)?;
///         Ok(reader.get()?)
///     },
/// )
/// # }
/// ```
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
    /// Calls through `port`. A call without a reply after `timeout` fails with
    /// [`CallError::Deadline`].
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

    /// The number of requests, commands included.
    pub fn sent(&self) -> &Counter {
        &self.sent
    }

    /// The longest time of a call.
    pub fn timeout(&self) -> Duration {
        self.timeout
    }

    /// Sets the longest time of a call.
    pub fn set_timeout(&mut self, timeout: Duration) {
        self.timeout = timeout;
    }

    /// The number of servers, 0 or 1.
    pub fn peers(&self) -> usize {
        self.port.peers()
    }

    /// Begins a request of `operation`. Put its parameters into the writer, then send or call it.
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

    /// Sends the command that was begun. `Ok` means that the queue of a live server holds it.
    pub fn send(&mut self) -> Result<(), CallError> {
        let header = self.header();
        self.port.send(header, self.writer.finish()?)
    }

    /// Calls the query that was begun. Gives 0 for a result or the hash of an exception, and a
    /// reader of it.
    pub fn call(&mut self) -> Result<(i32, Reader<'_>), CallError> {
        let (header, pending) = (self.header(), self.pending());
        let (reply, mut replied) = (&mut self.reply, Header::default());
        self.port.call(
            header,
            self.writer.finish()?,
            self.timeout,
            &mut |header, body| {
                reply.clear();
                reply.extend_from_slice(body);
                replied = header;
            },
        )?;
        open(&self.reply, replied, pending)
    }

    /// The same; `read` reads the reply in the memory of the middleware.
    pub fn call_in_place<T, E: From<CallError>>(
        &mut self,
        read: impl FnOnce(i32, &mut Reader<'_>) -> Result<T, E>,
    ) -> Result<T, E> {
        let (header, pending) = (self.header(), self.pending());
        let (mut read, mut outcome) = (Some(read), None);
        let request = self.writer.finish().map_err(CallError::from)?;
        self.port
            .call(header, request, self.timeout, &mut |header, body| {
                if let Some(read) = read.take() {
                    outcome = Some(match open(body, header, pending) {
                        Ok((case, mut reader)) => read(case, &mut reader),
                        Err(error) => Err(error.into()),
                    });
                }
            })?;
        outcome.unwrap_or_else(|| Err(CallError::from(DecodeError::Truncated(0)).into()))
    }

    /// Sends a command, whose parameters `write` serializes. `Ok` means that the queue of a live
    /// server holds it.
    pub fn send_with(
        &mut self,
        operation: &Operation,
        write: impl Fn(&mut Writer<'_>),
    ) -> Result<(), CallError> {
        write(self.begin(operation));
        self.send()
    }

    /// Calls `operation`. `write` serializes the parameters. `read` gets 0 for a result or the hash
    /// of an exception, and reads the reply in the memory of the middleware.
    pub fn call_with<T, E: From<CallError>>(
        &mut self,
        operation: &Operation,
        write: impl Fn(&mut Writer<'_>),
        read: impl FnOnce(i32, &mut Reader<'_>) -> Result<T, E>,
    ) -> Result<T, E> {
        write(self.begin(operation));
        self.call_in_place(read)
    }

    fn pending(&self) -> PendingCall {
        PendingCall {
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

/// The request that a reply belongs to.
#[derive(Clone, Copy)]
struct PendingCall {
    id: RequestId,
    operation: i32,
    type_hash: u64,
    profile: Profile,
    replies: &'static [ReplyVariant],
}

/// Opens the envelope of a reply.
fn open(body: &[u8], header: Header, pending: PendingCall) -> Result<(i32, Reader<'_>), CallError> {
    let mut reader = Reader::new(body);
    match rpc::open_reply(&mut reader, pending.operation)? {
        (id, _) if id != pending.id => Err(DecodeError::Unknown("request in the reply").into()),
        (_, ReplyKind::Refused(reason)) => Err(CallError::Refused(reason)),
        (_, ReplyKind::Case(case)) => {
            if header.encoding == Encoding::Image {
                // A memory image is read only if its sender has the same types.
                if header.type_hash != pending.type_hash {
                    return Err(DecodeError::Unknown("type in the reply").into());
                }
                reader.image_at(BEHIND_ENVELOPE);
            }
            if pending.profile == Profile::Ros {
                rpc::open_body(&mut reader, pending.profile);
                let case = open_ros_reply(&mut reader, pending.replies)?;
                return Ok((case, reader));
            }
            Ok((case, reader))
        }
    }
}

/// Skips to the variant that a reply in [`Profile::Ros`] holds, and gives its case.
fn open_ros_reply(reader: &mut Reader<'_>, replies: &[ReplyVariant]) -> Result<i32, DecodeError> {
    if replies.is_empty() {
        return Ok(0);
    }
    let found: i32 = reader.get()?;
    for variant in replies.iter().filter(|variant| variant.case != 0) {
        if code(replies, variant.case) == found {
            return Ok(variant.case);
        }
        (variant.skip)(reader)?;
    }
    match found {
        0 => Ok(0),
        _ => Err(DecodeError::Unknown("code in the reply")),
    }
}

/// Fails if a reply is an exception, which the operation does not throw.
pub fn expect_result(case: i32) -> Result<(), DecodeError> {
    if case == 0 {
        Ok(())
    } else {
        Err(DecodeError::Unknown("exception in the reply"))
    }
}

/// A request that a server handles.
pub struct Request<'a> {
    /// The hash of the name of the operation.
    pub operation: i32,
    reader: Reader<'a>,
    id: RequestId,
    type_hash: u64,
    two_way: bool,
    replies: &'static [ReplyVariant],
    /// The variants behind the one that is being written.
    rest: &'static [ReplyVariant],
    writer: Writer<'static>,
    reply: &'a mut dyn Reply,
    placed: Option<Result<(), EncodeError>>,
}

impl<'a> Request<'a> {
    /// Opens the envelope of `body`. The reply is written into `reply`. It fails if there is no
    /// envelope.
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

    /// Reads the parameters of `operation` with `read`. If the types of the sender differ or the
    /// bytes are no parameters, the request is refused. Another program (type hash 0) is trusted to
    /// use the right types.
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
                "`{what}` has types {theirs:016x} there and {ours:016x} here; regenerate both components"
            );
            return self.refuse(Outcome::InvalidArgument, reason);
        }
        match read(&mut self.reader) {
            Ok(arguments) => Ok(arguments),
            Err(error) => self.refuse(Outcome::InvalidArgument, format!("`{what}`: {error}")),
        }
    }

    /// Begins the reply; `case` is 0 for a result, else the hash of an exception.
    pub fn begin(&mut self, case: i32) -> &mut Writer<'static> {
        self.writer.clear();
        rpc::begin_reply(&mut self.writer, self.id, self.operation, case);
        if self.reply.profile() == Profile::Ros {
            self.begin_ros_reply(case);
        }
        &mut self.writer
    }

    /// Writes what precedes the variant `case` in [`Profile::Ros`].
    fn begin_ros_reply(&mut self, case: i32) {
        rpc::begin_body(&mut self.writer, Profile::Ros);
        self.rest = &[];
        let replies = self.replies;
        if replies.is_empty() {
            return;
        }
        self.writer.put(&code(replies, case));
        let here = replies.iter().position(|variant| variant.case == case);
        for variant in &replies[..here.unwrap_or(replies.len())] {
            (variant.put)(&mut self.writer);
        }
        if let Some(at) = here.filter(|_| case != 0) {
            self.rest = &replies[at + 1..];
        }
    }

    /// Replies with what `write` serializes; `case` is 0 for a result, else the hash of an
    /// exception. Large arrays are written straight into memory of the middleware, which takes a
    /// second pass: `write` must write the same each time.
    pub fn reply_with(
        &mut self,
        case: i32,
        write: impl Fn(&mut Writer<'_>),
    ) -> Result<(), HandlerError> {
        if self.reply.profile() == Profile::Rpc && self.reply.can_loan(Encoding::Cdr) {
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

    /// Ends the reply. If it cannot be encoded, the request is refused with the reason.
    pub fn finish(&mut self) -> Result<(), HandlerError> {
        for variant in std::mem::take(&mut self.rest) {
            (variant.put)(&mut self.writer);
        }
        let written = self.writer.finish().map(|_| ());
        self.finished(written)
    }

    fn finished(&mut self, written: Result<(), EncodeError>) -> Result<(), HandlerError> {
        written.or_else(|error| {
            self.refuse(
                Outcome::UnknownException,
                format!("the reply cannot be sent: {error}"),
            )
        })
    }

    /// Lets `fill` write the result in place; [`Request::finish_in_place`] sends it. Without shared
    /// memory the result is copied.
    pub fn in_place<T: InPlace, R>(
        &mut self,
        fill: impl FnOnce(&mut T) -> R,
    ) -> Result<R, HandlerError> {
        // Another program, which proves no types, gets CDR.
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

    /// Ends a reply that was written in place.
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

    /// Replies that the handler failed with an error that its operation does not declare.
    pub fn fail(&mut self, reason: &dyn std::fmt::Display) -> Result<(), HandlerError> {
        self.refuse(Outcome::UnknownException, reason.to_string())
    }

    /// Replies that the interface does not have the operation.
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

    /// Hands over the reply. A command has none.
    pub fn close(self) {
        let reply = self.reply.body();
        *reply = self.writer.into_bytes();
        if !self.two_way {
            reply.clear();
        }
    }
}

/// The reason why a message was not handled. The runtime logs and counts it.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct HandlerError(pub String);

impl From<DecodeError> for HandlerError {
    fn from(error: DecodeError) -> Self {
        Self(error.to_string())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::backend::LoanedSample;
    use std::cell::Cell;

    /// Large enough to be written straight into lent memory.
    const LARGE: usize = 64 * 1024;

    const OPERATION: Operation = Operation {
        name: "image",
        id: 1,
        type_hash: 2,
        two_way: false,
        replies: &[],
    };

    /// Lends memory, or has none left.
    struct Lending {
        fails: bool,
    }

    struct Lent(Vec<u8>);

    impl Publisher for Lending {
        fn publish(&mut self, _: Header, _: &[u8]) -> Result<(), SendError> {
            Ok(())
        }

        fn can_loan(&self, _: Encoding) -> bool {
            true
        }

        fn loan(&mut self, length: usize) -> Result<Box<dyn LoanedSample + '_>, SendError> {
            if self.fails {
                return Err(EncodeError::NoMemory(length).into());
            }
            Ok(Box::new(Lent(vec![0; length])))
        }

        fn peers(&self) -> usize {
            0
        }
    }

    impl LoanedSample for Lent {
        fn memory(&self) -> &[u8] {
            &self.0
        }

        fn memory_mut(&mut self) -> &mut [u8] {
            &mut self.0
        }

        fn send(self: Box<Self>, _: Header) -> Result<(), SendError> {
            Ok(())
        }
    }

    fn publisher(fails: bool) -> TypedPublisher {
        TypedPublisher::new(Box::new(Lending { fails }), OPERATION)
    }

    #[test]
    fn a_value_that_changes_between_the_passes_is_not_sent() {
        for (first, second) in [(LARGE, LARGE + 8), (LARGE + 8, LARGE)] {
            let mut publisher = publisher(false);
            let pass = Cell::new(0);
            let sent = publisher.publish_with(|writer| {
                let length = if pass.replace(1) == 0 { first } else { second };
                writer.put(&vec![7_u8; length]);
                writer.put(&1_u8);
            });
            assert_eq!(sent, Err(SendError::Invalid(EncodeError::Changed)));
            assert_eq!(publisher.sent().get(), 0);
        }
    }

    #[test]
    fn a_sample_without_memory_is_counted_as_lost() {
        let image = vec![7_u8; LARGE];
        for (fails, expected) in [(false, Ok(())), (true, Err(()))] {
            let mut publisher = publisher(fails);
            let sent = publisher.publish_with(|writer| writer.put(&image));
            assert_eq!(sent.map_err(drop), expected);
            assert_eq!(publisher.sent().get(), 1);
        }
    }

    /// Lends nothing.
    #[test]
    fn a_reply_is_written_once_where_nothing_is_lent() {
        let mut body = rpc_request();
        let request = std::mem::take(&mut body);
        let mut request = Request::open(Header::default(), &request, &mut body).expect("opened");
        let passes = Cell::new(0);
        let image = vec![7_u8; LARGE];
        let replied = request.reply_with(0, |writer| {
            passes.set(passes.get() + 1);
            writer.put(&image);
        });
        assert_eq!(replied, Ok(()));
        assert_eq!(passes.get(), 1);
        request.close();
        assert!(body.len() > LARGE);
    }

    fn rpc_request() -> Vec<u8> {
        let mut writer = Writer::default();
        let id = RequestId {
            writer: [1; 16],
            sequence: 1,
        };
        rpc::begin_request(&mut writer, id, OPERATION.id);
        writer.into_bytes()
    }
}
