//! A request on the side of its server: reads the parameters, writes the reply.

use super::{HandlerError, Operation, ReplyVariant, Returned, Throws, code, fill, unsendable};
use crate::backend::{DeferredReply, Profile, Reply};
use crate::cdr::{DecodeError, EncodeError, Reader, Writer};
use crate::error::ReceiveError;
use crate::header::{Encoding, Header};
use crate::in_place::{self, BEHIND_ENVELOPE, InPlace};
use crate::rpc::{self, Envelope, Outcome, RequestId};
use crate::shared_value::{Message, SharedValue};
use std::time::Duration;

/// Prefix of a reply before the variant `case`.
#[derive(Clone, Copy)]
struct Beginning {
    id: RequestId,
    operation: i32,
    case: i32,
    profile: Profile,
    replies: &'static [ReplyVariant],
}

impl Beginning {
    /// Writes the envelope, and in [`Profile::Bare`] the code and the variants before this one.
    fn write(self, writer: &mut Writer<'_>) {
        rpc::begin_reply(writer, self.id, self.operation, self.case);
        if self.profile == Profile::Bare {
            rpc::begin_body(writer, Profile::Bare);
            if !self.replies.is_empty() {
                writer.put(&code(self.replies, self.case));
                let here = self.place().unwrap_or(self.replies.len());
                for variant in &self.replies[..here] {
                    variant.codec.put(writer);
                }
            }
        }
    }

    /// The variants that follow in [`Profile::Bare`].
    fn rest(self) -> &'static [ReplyVariant] {
        match self.place() {
            Some(at) if self.profile == Profile::Bare && self.case != 0 => &self.replies[at + 1..],
            _ => &[],
        }
    }

    fn place(self) -> Option<usize> {
        self.replies
            .iter()
            .position(|variant| variant.case == self.case)
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
    /// The variants after the one that is being written.
    rest: &'static [ReplyVariant],
    writer: Writer<'static>,
    reply: &'a mut dyn Reply,
    placed: Option<Result<(), EncodeError>>,
    is_refused: bool,
}

impl<'a> Request<'a> {
    /// Opens the envelope of `body`. The reply is written into `reply`. It fails if there is no
    /// envelope.
    pub fn open(
        header: Header,
        body: &'a [u8],
        reply: &'a mut dyn Reply,
    ) -> Result<Self, DecodeError> {
        Self::begin_with(header, Reader::of(body, header.encoding), reply)
    }

    /// [`Request::open`] for a message that may be a value.
    pub fn open_message(
        header: Header,
        message: &'a Message<'_>,
        reply: &'a mut dyn Reply,
    ) -> Result<Self, DecodeError> {
        Self::begin_with(header, message.reader(header.encoding), reply)
    }

    fn begin_with(
        header: Header,
        mut reader: Reader<'a>,
        reply: &'a mut dyn Reply,
    ) -> Result<Self, DecodeError> {
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
            is_refused: false,
        })
    }

    /// Reads the parameters of `operation` with `read`. If the types of the sender differ or the
    /// bytes are not parameters, the request is refused. Another program (type hash 0) is trusted
    /// to use the right types.
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

    /// Says how old the value of the reply is, which was there before the request.
    pub fn set_age(&mut self, age: Duration) {
        self.reply.set_age(age);
    }

    /// Lets `handle` handle a command, whose parameters `read` reads.
    pub fn command<A>(
        &mut self,
        operation: &Operation,
        read: impl FnOnce(&mut Reader<'a>) -> Result<A, DecodeError>,
        handle: impl FnOnce(A),
    ) -> Result<(), HandlerError> {
        handle(self.arguments(operation, read)?);
        Ok(())
    }

    /// Lets `handle` answer a query that throws nothing: `read` reads its parameters, `write`
    /// writes its result.
    pub fn answer<A, R: Send + Sync + 'static>(
        &mut self,
        operation: &Operation,
        read: impl FnOnce(&mut Reader<'a>) -> Result<A, DecodeError>,
        write: fn(&R, &mut Writer<'_>),
        handle: impl FnOnce(A) -> R,
    ) -> Result<(), HandlerError> {
        let result = handle(self.arguments(operation, read)?);
        self.reply_value(0, result, write)
    }

    /// [`Request::answer`] for a query that throws.
    pub fn try_answer<A, R: Send + Sync + 'static, E: Throws>(
        &mut self,
        operation: &Operation,
        read: impl FnOnce(&mut Reader<'a>) -> Result<A, DecodeError>,
        write: fn(&R, &mut Writer<'_>),
        handle: impl FnOnce(A) -> Result<R, E>,
    ) -> Result<(), HandlerError> {
        match handle(self.arguments(operation, read)?) {
            Ok(result) => self.reply_value(0, result, write),
            Err(error) => error.refuse(self),
        }
    }

    /// [`Request::answer`] for a result that `handle` writes in place.
    pub fn answer_in_place<A, T: InPlace>(
        &mut self,
        operation: &Operation,
        read: impl FnOnce(&mut Reader<'a>) -> Result<A, DecodeError>,
        handle: impl FnOnce(A, &mut T),
    ) -> Result<(), HandlerError> {
        let arguments = self.arguments(operation, read)?;
        self.in_place(|result| handle(arguments, result))?;
        self.finish_in_place()
    }

    /// [`Request::answer_in_place`] for a query that throws.
    pub fn try_answer_in_place<A, T: InPlace, E: Throws>(
        &mut self,
        operation: &Operation,
        read: impl FnOnce(&mut Reader<'a>) -> Result<A, DecodeError>,
        handle: impl FnOnce(A, &mut T) -> Result<(), E>,
    ) -> Result<(), HandlerError> {
        let arguments = self.arguments(operation, read)?;
        match self.in_place(|result| handle(arguments, result))? {
            Ok(()) => self.finish_in_place(),
            Err(error) => error.refuse(self),
        }
    }

    /// Replies with the exception whose hash is `case`.
    pub fn throw<E: Returned>(&mut self, case: i32, exception: E) -> Result<(), HandlerError> {
        self.reply_value(case, exception, E::write)
    }

    /// Replies with a result that answers other requests, too. A client in this process gets a clone.
    pub fn reply_again<R: Clone + Send + Sync + 'static>(
        &mut self,
        result: &R,
        write: fn(&R, &mut Writer<'_>),
    ) -> Result<(), HandlerError> {
        if self.two_way && self.reply.takes_values() {
            return self.reply_value(0, result.clone(), write);
        }
        self.reply_with(0, |writer| write(result, writer))
    }

    /// Replies with a result, or with an exception, which a client in this process gets as it is.
    fn reply_value<R: Send + Sync + 'static>(
        &mut self,
        case: i32,
        result: R,
        write: fn(&R, &mut Writer<'_>),
    ) -> Result<(), HandlerError> {
        if self.two_way && self.reply.takes_values() {
            // Only an envelope in another profile has another length.
            let envelope = self.begin(case).finish().ok();
            if let Some(Ok(envelope)) = envelope.map(Envelope::try_from) {
                let value = SharedValue::of_result(envelope, result, write);
                self.writer.clear();
                let sent = value.map(|value| self.reply.send_value(value));
                return self.finished(sent);
            }
        }
        self.reply_with(case, |writer| write(&result, writer))
    }

    /// Begins the reply; `case` is 0 for a result, else the hash of an exception.
    fn begin(&mut self, case: i32) -> &mut Writer<'static> {
        let begin = self.beginning(case);
        self.rest = begin.rest();
        self.writer.clear();
        begin.write(&mut self.writer);
        &mut self.writer
    }

    fn beginning(&self, case: i32) -> Beginning {
        Beginning {
            id: self.id,
            operation: self.operation,
            case,
            profile: self.reply.profile(),
            replies: self.replies,
        }
    }

    /// Replies with the output of `write`; `case` is 0 for a result, else the hash of an exception.
    /// Large arrays are written straight into memory of the middleware, which takes a second pass:
    /// `write` must write the same each time.
    pub fn reply_with(
        &mut self,
        case: i32,
        write: impl Fn(&mut Writer<'_>),
    ) -> Result<(), HandlerError> {
        if self.reply.can_loan(Encoding::Cdr) {
            let begin = self.beginning(case);
            let whole = |writer: &mut Writer<'_>| {
                begin.write(writer);
                write(writer);
                for variant in begin.rest() {
                    variant.codec.put(writer);
                }
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
    fn finish(&mut self) -> Result<(), HandlerError> {
        for variant in std::mem::take(&mut self.rest) {
            variant.codec.put(&mut self.writer);
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

    /// Replies that the server does not serve `operation` in `state`. Returns the reason for the
    /// log.
    pub fn unavailable(&mut self, operation: &Operation, state: &str) -> String {
        self.two_way = operation.two_way;
        self.is_refused = true;
        self.writer.clear();
        rpc::refuse_in(&mut self.writer, self.id, state);
        format!("`{}` is {}", operation.name, rpc::not_served_in(state))
    }

    fn refuse<T>(&mut self, outcome: Outcome, reason: String) -> Result<T, HandlerError> {
        self.is_refused = true;
        self.writer.clear();
        rpc::refuse(&mut self.writer, self.id, outcome, &reason);
        Err(HandlerError(reason))
    }

    /// Defers the reply, for a handler that knows the operation of the request
    /// ([`Request::arguments`]). `None` for a command, and if the middleware cannot.
    pub fn defer(&mut self) -> Option<DeferredRequest> {
        if !self.two_way {
            return None;
        }
        let reply = self.reply.defer()?;
        Some(DeferredRequest {
            operation: self.operation,
            id: self.id,
            type_hash: self.type_hash,
            replies: self.replies,
            reply,
        })
    }

    /// Hands over the reply. A command has none, unless its client waits for the end of commands,
    /// too ([`Profile::Bare`]), and it was refused.
    pub fn close(self) {
        let keeps = self.two_way || (self.is_refused && self.reply.profile() == Profile::Bare);
        let reply = self.reply.body();
        *reply = self.writer.into_bytes();
        if !keeps {
            reply.clear();
        }
    }
}

/// A request whose reply comes later.
#[must_use = "dropping it leaves the client without a reply"]
pub struct DeferredRequest {
    operation: i32,
    id: RequestId,
    type_hash: u64,
    replies: &'static [ReplyVariant],
    reply: Box<dyn DeferredReply>,
}

impl DeferredRequest {
    /// Lets `write` reply.
    ///
    /// # Errors
    /// The reply was not sent.
    pub fn reply(self, write: impl FnOnce(&mut Request<'_>)) -> Result<(), ReceiveError> {
        let mut write = Some(write);
        self.reply.send(&mut |reply| {
            let writer = Writer::over(std::mem::take(reply.body()));
            let mut request = Request {
                operation: self.operation,
                reader: Reader::new(&[]),
                id: self.id,
                type_hash: self.type_hash,
                two_way: true,
                replies: self.replies,
                rest: &[],
                writer,
                reply,
                placed: None,
                is_refused: false,
            };
            if let Some(write) = write.take() {
                write(&mut request);
            }
            request.close();
        })
    }
}
