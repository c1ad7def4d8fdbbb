//! Calls the operations of one interface.

mod reply;

pub use reply::{Ended, expect_result, reply_values};

use super::call::{Call, CallId};
use super::{Operation, Put, Returned, Throws, fill, result};
use crate::backend::Client;
use crate::cdr::{DecodeError, Reader, Writer};
use crate::counter::Counter;
use crate::error::CallError;
use crate::freshness::Freshness;
use crate::header::{Header, now};
use crate::request_body::{RequestBody, Written};
use crate::rpc::{self, Envelope, RequestId};
use crate::shared_value::{HeldValue, SharedValue};
use crate::started::{Awaiting, STARTED_CALLS};
use reply::{PendingCall, open, read_reply};
use std::any::Any;
use std::collections::BTreeMap;
use std::sync::Weak;
use std::time::Duration;

/// Calls the operations of one interface.
///
/// ```no_run
/// use rc_middleware::typed::{Operation, TypedClient};
/// use rc_middleware::{CallError, Client};
/// use std::time::Duration;
///
/// # fn ask(port: Box<dyn Client>, double: &Operation) -> Result<i32, CallError> {
/// let mut client = TypedClient::new(port, Duration::from_secs(1));
/// client.call(double, (&21_i32,))
/// # }
/// ```
pub struct TypedClient {
    port: Box<dyn Client>,
    writer: Writer<'static>,
    id: RequestId,
    timeout: Duration,
    sent: Counter,
    age: Duration,
    started: BTreeMap<u64, Started>,
    /// Calls that have ended and that somebody still has.
    ended: BTreeMap<u64, EndedResult>,
}

/// A call that was started: what its reply has to be, and whether somebody still has the [`Call`].
struct Started {
    request: PendingCall,
    holder: Weak<()>,
}

/// A call that has ended, with its result until it is taken.
struct EndedResult {
    result: Option<Box<dyn Any>>,
    holder: Weak<()>,
}

/// Sends a request.
type Send<'f> = dyn FnMut(&mut dyn Client, Header, &dyn RequestBody) -> Result<(), CallError> + 'f;

/// Lets a worker `W` with its context `C` handle the end of a call.
pub type Done<W, C> = Box<dyn FnOnce(&mut W, &mut C)>;

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
            id,
            timeout,
            sent: Counter::default(),
            age: Duration::ZERO,
            started: BTreeMap::new(),
            ended: BTreeMap::new(),
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

    /// The age of the last reply, and what it is made of. `None` if the slot has neither `fresh` nor
    /// `cache`, or no reply came.
    pub fn freshness(&self) -> Option<Freshness> {
        self.port.freshness()
    }

    /// How old the value of the last reply was when its call began, see [`Ended::age`]. That of a
    /// started call is in its end.
    pub fn age(&self) -> Duration {
        self.age
    }

    /// Sends a command, whose parameters `write` serializes. `Ok` means that the queue of a live
    /// server holds it.
    pub fn send_with(
        &mut self,
        operation: &Operation,
        write: impl Fn(&mut Writer<'_>),
    ) -> Result<(), CallError> {
        self.id.sequence = self.sent.next();
        self.submit(operation, write, &mut |port, header, request| {
            port.send(header, request)
        })
    }

    /// Calls `operation`. `write` serializes the parameters, as for a sample of
    /// [`super::TypedPublisher::publish_with`]. `read` gets 0 for a result or the hash
    /// of an exception, and reads the reply in the memory of the middleware.
    pub fn call_with<T, E: From<CallError>>(
        &mut self,
        operation: &Operation,
        write: impl Fn(&mut Writer<'_>),
        read: impl FnOnce(i32, &mut Reader<'_>) -> Result<T, E>,
    ) -> Result<T, E> {
        self.call_through(operation, read, |client, send| {
            client.submit(operation, write, send)
        })
    }

    /// Lets `submit` send a request with the given function, and `read` read the reply.
    fn call_through<T, E: From<CallError>>(
        &mut self,
        operation: &Operation,
        read: impl FnOnce(i32, &mut Reader<'_>) -> Result<T, E>,
        submit: impl FnOnce(&mut Self, &mut Send<'_>) -> Result<(), CallError>,
    ) -> Result<T, E> {
        let (mut read, mut outcome) = (Some(read), None);
        let timeout = self.timeout;
        self.id.sequence = self.sent.next();
        let mut pending = self.pending(operation);
        let mut age = Duration::ZERO;
        let submitted = submit(self, &mut |port, header, request| {
            pending.sent(port, header);
            port.call_message(header, request, timeout, &mut |header, message| {
                age = pending.age(header);
                if let Some(read) = read.take() {
                    outcome = Some(match open(&message, header, pending) {
                        Ok((case, mut reader)) => read(case, &mut reader),
                        Err(error) => Err(error.into()),
                    });
                }
            })
        });
        self.age = age;
        submitted?;
        outcome.unwrap_or_else(|| Err(CallError::from(DecodeError::Truncated(0)).into()))
    }

    /// Sends a command with these parameters. `Ok` means that the queue of a live server holds it.
    pub fn send(&mut self, operation: &Operation, arguments: impl Put) -> Result<(), CallError> {
        self.id.sequence = self.sent.next();
        self.submit_parts(operation, arguments, &mut |port, header, request| {
            port.send(header, request)
        })
    }

    /// Calls `operation` with these parameters.
    pub fn call<R: Returned, E: Throws>(
        &mut self,
        operation: &Operation,
        arguments: impl Put,
    ) -> Result<R, E> {
        self.query(operation, arguments, result)
    }

    /// [`TypedClient::call`] for a result that `read` reads.
    pub fn query<R, E: Throws>(
        &mut self,
        operation: &Operation,
        arguments: impl Put,
        read: impl FnOnce(&mut Reader<'_>) -> Result<R, DecodeError>,
    ) -> Result<R, E> {
        let read = |case, reader: &mut Reader<'_>| read_reply(case, reader, read);
        self.call_through(operation, read, |client, send| {
            client.submit_parts(operation, arguments, send)
        })
    }

    /// Starts a call of `operation` and returns at once. [`TypedClient::poll_with`] ends it within
    /// the timeout; dropping the [`Call`] forgets it. `write` serializes the parameters.
    ///
    /// # Errors
    /// The request was not sent, for example because [`STARTED_CALLS`] have not ended. A result that
    /// waits for [`TypedClient::take`] counts as well.
    pub fn start_with<R, E: From<CallError>>(
        &mut self,
        operation: &Operation,
        write: impl Fn(&mut Writer<'_>),
    ) -> Result<Call<R, E>, E> {
        self.start_through(operation, |client, send| {
            client.submit(operation, write, send)
        })
    }

    /// Lets `submit` send a request with the given function, without waiting for the reply.
    fn start_through<R, E: From<CallError>>(
        &mut self,
        operation: &Operation,
        submit: impl FnOnce(&mut Self, &mut Send<'_>) -> Result<(), CallError>,
    ) -> Result<Call<R, E>, E> {
        self.forget_dropped();
        let kept = self.ended.values().filter(|left| left.result.is_some());
        if self.started.len() + kept.count() >= STARTED_CALLS {
            return Err(CallError::TooManyStarted.into());
        }
        let timeout = self.timeout;
        self.id.sequence = self.sent.next();
        let mut request = self.pending(operation);
        submit(self, &mut |port, header, body| {
            request.sent(port, header);
            port.start(header, body, timeout)
        })?;
        let (call, holder) = Call::new(request.id);
        self.started
            .insert(request.id.sequence, Started { request, holder });
        Ok(call)
    }

    /// [`TypedClient::start_with`] for parameters that are a value.
    pub fn start<R, E: From<CallError>>(
        &mut self,
        operation: &Operation,
        arguments: impl Put,
    ) -> Result<Call<R, E>, E> {
        self.start_through(operation, |client, send| {
            client.submit_parts(operation, arguments, send)
        })
    }

    /// Hands the next started call that has ended to `read`, the oldest first, and gives its
    /// value. The reply is read in the memory of the middleware.
    pub fn poll_with<T>(&mut self, read: impl FnOnce(Ended<'_>) -> T) -> Option<T> {
        self.forget_dropped();
        let Self {
            port,
            started,
            ended,
            ..
        } = self;
        let mut end = |sequence: u64| {
            let Started { request, holder } = started.remove(&sequence)?;
            let result = None;
            ended.insert(sequence, EndedResult { result, holder });
            Some(request)
        };
        let (mut read, mut value) = (Some(read), None);
        let polled = port.poll_message(&mut |sequence, header, message| {
            if let (Some(request), Some(read)) = (end(sequence), read.take()) {
                let reply = open(&message, header, request);
                value = Some(read(request.ended(request.age(header), reply)));
            }
        });
        let (sequence, result) = polled?;
        if value.is_some() {
            return value;
        }
        let (request, read) = (end(sequence)?, read?);
        let error = result.err()?;
        Some(read(request.ended(Duration::ZERO, Err(error))))
    }

    /// Keeps the result of a call that has ended until it is taken, or its [`Call`] is dropped.
    pub fn leave<R: 'static, E: 'static>(&mut self, call: CallId, result: Result<R, E>) {
        if let Some(left) = self.ended.get_mut(&call.0.sequence) {
            left.result = Some(Box::new(result));
        }
    }

    /// Takes the kept result, once. `None` if the call has not ended, or its result was handled.
    pub fn take<R: 'static, E: 'static>(&mut self, call: &Call<R, E>) -> Option<Result<R, E>> {
        let CallId(id) = call.id();
        let is_own = id.writer == self.id.writer;
        let left = self.ended.get_mut(&id.sequence).filter(|_| is_own)?;
        let result = left.result.take()?.downcast().ok()?;
        self.ended.remove(&id.sequence);
        Some(*result)
    }

    /// Whether started calls end in the order of their start, see [`Client::end_in_order`].
    pub fn end_in_order(&mut self, keeps: bool) {
        self.port.end_in_order(keeps);
    }

    /// The descriptor and time to wait for while started calls have not ended, see
    /// [`Client::awaiting`].
    pub fn awaiting(&self) -> Option<Awaiting<'_>> {
        self.port.awaiting()
    }

    /// Forgets the calls without an owner.
    fn forget_dropped(&mut self) {
        let port = &mut self.port;
        self.started.retain(|sequence, call| {
            let is_held = call.holder.strong_count() > 0;
            if !is_held {
                port.forget(*sequence);
            }
            is_held
        });
        self.ended.retain(|_, call| call.holder.strong_count() > 0);
    }

    /// Passes a request of `operation` to `send`, for a server in this process as a value.
    fn submit_parts(
        &mut self,
        operation: &Operation,
        arguments: impl Put,
        send: &mut Send<'_>,
    ) -> Result<(), CallError> {
        if !self.port.takes_values() {
            return self.submit(operation, |writer| arguments.put(writer), send);
        }
        let header = self.header(operation);
        self.writer.clear();
        rpc::begin_request(&mut self.writer, self.id, operation.id);
        let Ok(envelope) = Envelope::try_from(self.writer.finish()?) else {
            return self.submit(operation, |writer| arguments.put(writer), send);
        };
        let request = HeldValue::from(SharedValue::behind(Some(envelope), arguments)?);
        send(&mut *self.port, header, &request)
    }

    fn header(&self, operation: &Operation) -> Header {
        Header {
            type_hash: operation.type_hash,
            sequence: self.id.sequence,
            sent: now(),
            ..Header::default()
        }
    }

    /// Passes a request of `operation` to `send`. Where the middleware lends memory, large arrays
    /// are written straight into it, which takes a second pass.
    fn submit(
        &mut self,
        operation: &Operation,
        write: impl Fn(&mut Writer<'_>),
        send: &mut Send<'_>,
    ) -> Result<(), CallError> {
        let (id, profile) = (self.id, self.port.profile());
        let whole = |writer: &mut Writer<'_>| {
            rpc::begin_request(writer, id, operation.id);
            rpc::begin_body(writer, profile);
            write(writer);
        };
        if self.port.can_loan() {
            self.writer.measure();
        } else {
            self.writer.clear();
        }
        whole(&mut self.writer);
        let (is_complete, length) = (!self.writer.has_skipped(), self.writer.len());
        let header = self.header(operation);
        let begin = self.writer.finish()?;
        if is_complete {
            return send(&mut *self.port, header, &begin);
        }
        let write = |memory: &mut [u8]| fill(memory, whole);
        let request = Written {
            begin,
            length,
            write,
        };
        send(&mut *self.port, header, &request)
    }

    fn pending(&self, operation: &Operation) -> PendingCall {
        PendingCall {
            id: self.id,
            operation: operation.id,
            type_hash: operation.type_hash,
            profile: self.port.profile(),
            replies: operation.replies,
            asked: 0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::header::Encoding;
    use crate::in_place::BEHIND_ENVELOPE;
    use std::collections::VecDeque;

    const OPERATION: Operation = Operation {
        name: "double",
        id: 5,
        type_hash: 9,
        two_way: true,
        replies: &[],
    };

    /// A backend that hands any reply to the caller: `reply` makes it from the request's identity.
    struct Answering {
        reply: fn(RequestId) -> (Header, Vec<u8>),
        started: VecDeque<(u64, RequestId)>,
    }

    impl Client for Answering {
        fn guid(&self) -> [u8; 16] {
            [7; 16]
        }

        fn send(&mut self, _: Header, _: &dyn RequestBody) -> Result<(), CallError> {
            Ok(())
        }

        fn call(
            &mut self,
            _: Header,
            request: &dyn RequestBody,
            _: Duration,
            take: &mut dyn FnMut(Header, &[u8]),
        ) -> Result<(), CallError> {
            let id = rpc::request_id(request.begin()).expect("an envelope");
            let (header, body) = (self.reply)(id);
            take(header, &body);
            Ok(())
        }

        fn start(
            &mut self,
            header: Header,
            request: &dyn RequestBody,
            _: Duration,
        ) -> Result<(), CallError> {
            let id = rpc::request_id(request.begin()).expect("an envelope");
            self.started.push_back((header.sequence, id));
            Ok(())
        }

        fn poll(
            &mut self,
            take: &mut dyn FnMut(u64, Header, &[u8]),
        ) -> Option<(u64, Result<(), CallError>)> {
            let (sequence, id) = self.started.pop_front()?;
            let (header, body) = (self.reply)(id);
            take(sequence, header, &body);
            Some((sequence, Ok(())))
        }

        fn forget(&mut self, sequence: u64) {
            self.started.retain(|(of, _)| *of != sequence);
        }

        fn peers(&self) -> usize {
            1
        }
    }

    fn client(reply: fn(RequestId) -> (Header, Vec<u8>)) -> TypedClient {
        let started = VecDeque::new();
        TypedClient::new(
            Box::new(Answering { reply, started }),
            Duration::from_secs(1),
        )
    }

    fn call(reply: fn(RequestId) -> (Header, Vec<u8>)) -> Result<i32, CallError> {
        client(reply).call_with(
            &OPERATION,
            |writer| writer.put(&21_i32),
            |case, reader| {
                expect_result(case)?;
                Ok(reader.get()?)
            },
        )
    }

    fn reply(id: RequestId, operation: i32) -> (Header, Vec<u8>) {
        let mut writer = Writer::default();
        rpc::begin_reply(&mut writer, id, operation, 0);
        writer.put(&42_i32);
        (Header::default(), writer.into_bytes())
    }

    type Doubling = Call<i32, CallError>;

    fn start(client: &mut TypedClient) -> Result<Doubling, CallError> {
        client.start(&OPERATION, (&21_i32,))
    }

    /// Ends the next call, whose result is left.
    fn end(client: &mut TypedClient) -> Option<CallId> {
        let (id, result) = client.poll_with(|ended| {
            let id = ended.id;
            (id, ended.result::<i32, CallError>())
        })?;
        client.leave(id, result);
        Some(id)
    }

    #[test]
    fn a_result_that_is_left_is_taken_once() {
        let mut client = client(|id| reply(id, OPERATION.id));
        let first = start(&mut client).expect("to be started");
        let second = start(&mut client).expect("to be started");
        assert_eq!(client.take(&first), None);
        assert_eq!(end(&mut client), Some(first.id()));
        assert_eq!(client.take(&second), None);
        assert_eq!(client.take(&first), Some(Ok(42)));
        assert_eq!(client.take(&first), None);
        drop(second);
        assert_eq!(end(&mut client), None);
    }

    #[test]
    fn results_that_nobody_takes_count_until_their_calls_are_dropped() {
        let mut client = client(|id| reply(id, OPERATION.id));
        let started = (0..STARTED_CALLS).map(|_| start(&mut client).expect("to be started"));
        let mut calls: Vec<Doubling> = started.collect();
        let full = |client: &mut TypedClient| start(client).err();
        assert_eq!(full(&mut client), Some(CallError::TooManyStarted));
        while end(&mut client).is_some() {}
        assert_eq!(full(&mut client), Some(CallError::TooManyStarted));
        assert_eq!(client.take(&calls[0]), Some(Ok(42)));
        calls.push(start(&mut client).expect("room for one call"));
        assert_eq!(full(&mut client), Some(CallError::TooManyStarted));
        calls.truncate(1);
        calls.push(start(&mut client).expect("room again"));
        assert_eq!(client.ended.len(), 0);
    }

    #[test]
    fn only_the_reply_to_the_request_counts() {
        assert_eq!(call(|id| reply(id, OPERATION.id)), Ok(42));
        let unknown = |what| Err(CallError::Malformed(DecodeError::Unknown(what)));
        let other_number = call(|id| {
            let sequence = id.sequence + 1;
            reply(RequestId { sequence, ..id }, OPERATION.id)
        });
        assert_eq!(other_number, unknown("request in the reply"));
        let other_client = call(|id| {
            let writer = [8; 16];
            reply(RequestId { writer, ..id }, OPERATION.id)
        });
        assert_eq!(other_client, unknown("request in the reply"));
        let other_operation = call(|id| reply(id, OPERATION.id + 1));
        assert_eq!(other_operation, unknown("operation in the reply"));
        // A refusal of another request is none of this one.
        let refused = call(|id| {
            let mut writer = Writer::default();
            let sequence = id.sequence + 1;
            let other = RequestId { sequence, ..id };
            rpc::refuse(&mut writer, other, rpc::Outcome::Unsupported, "no");
            (Header::default(), writer.into_bytes())
        });
        assert_eq!(refused, unknown("request in the reply"));
        // An image is read only from a sender with the same types.
        let image = call(|id| {
            let (header, mut body) = reply(id, OPERATION.id);
            body.resize(BEHIND_ENVELOPE + 4, 0);
            let encoding = Encoding::Image;
            (
                Header {
                    encoding,
                    type_hash: 8,
                    ..header
                },
                body,
            )
        });
        assert_eq!(image, unknown("type in the reply"));
    }
}
