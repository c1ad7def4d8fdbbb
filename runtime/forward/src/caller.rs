//! The client of a slot, with the calls that it has started.

use rc_host::{Operation, read, write};
use rc_middleware::cdr::Cdr;
use rc_middleware::rpc::ENVELOPE_OF_VALUES;
use rc_middleware::started::{Awaiting, STARTED_CALLS};
use rc_middleware::typed::{Call, CallId, DeferredRequest, HandlerError, Request, TypedClient};
use rc_middleware::{CallError, EncodeError, Reader, Writer, wait};
use rc_runtime::{CallEnd, ForwardCounts};
use rc_values::Struct;
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// The shortest time between two log messages about calls that failed.
const LOG_PAUSE: Duration = Duration::from_secs(1);

/// A client with the calls that have not ended.
pub(crate) struct Caller<'d> {
    pub(crate) client: TypedClient,
    waiting: BTreeMap<CallId, Waiting<'d>>,
    logged: Option<Instant>,
}

/// A request that waits for its reply.
struct Waiting<'d> {
    request: DeferredRequest,
    operation: &'d Operation,
    counts: ForwardCounts,
    /// How long the request took until it was sent.
    there: Duration,
    _call: Call<(), CallError>,
}

impl<'d> Caller<'d> {
    pub(crate) fn new(client: TypedClient) -> Self {
        Self {
            client,
            waiting: BTreeMap::new(),
            logged: None,
        }
    }

    /// Whether one more call may start.
    pub(crate) fn has_room(&self) -> bool {
        self.under_way() < STARTED_CALLS
    }

    /// How many calls have not ended.
    pub(crate) fn under_way(&self) -> usize {
        self.waiting.len()
    }

    pub(crate) fn awaiting(&self) -> Option<Awaiting<'_>> {
        self.client.awaiting()
    }

    /// Sends a request, whose reply [`Caller::end`] forwards.
    pub(crate) fn start(
        &mut self,
        operation: &'d Operation,
        arguments: &Reader<'_>,
        counts: &ForwardCounts,
        request: DeferredRequest,
    ) -> Result<(), HandlerError> {
        let begin = Instant::now();
        let started = self.client.start_with(&operation.wire, |writer| {
            pass_arguments(operation, arguments, writer);
        });
        let call = match started {
            Ok(call) => call,
            Err(error) => {
                let mut result = Ok(());
                let sent = request.reply(|request| result = refuse(operation, request, &error));
                return sent
                    .map_err(|error| HandlerError(error.to_string()))
                    .and(result);
            }
        };
        let id = call.id();
        let waiting = Waiting {
            request,
            operation,
            counts: counts.clone(),
            there: begin.elapsed(),
            _call: call,
        };
        self.waiting.insert(id, waiting);
        Ok(())
    }

    /// Forwards the next reply, or the reason why there is none. `None` if no call has ended.
    pub(crate) fn end(&mut self) -> Option<CallEnd> {
        let Self {
            client, waiting, ..
        } = self;
        let (end, result) = client.poll_with(|ended| {
            let replied = Instant::now();
            let end = CallEnd::of(&ended);
            let Some(waiting) = waiting.remove(&ended.id) else {
                return (end, Ok(()));
            };
            let operation = waiting.operation;
            let mut result = Ok(());
            let age = ended.age;
            let sent = waiting.request.reply(|request| {
                request.set_age(age);
                let passed =
                    ended.read(|case, reader| pass_reply(operation, case, reader, request));
                result = passed.unwrap_or_else(|error| refuse(operation, request, &error));
            });
            waiting.counts.note(waiting.there + replied.elapsed());
            let sent = sent.map_err(|error| HandlerError(error.to_string()));
            (end, sent.and(result))
        })?;
        if let Err(error) = result
            && self.logged.is_none_or(|last| last.elapsed() >= LOG_PAUSE)
        {
            self.logged = Some(Instant::now());
            rc_runtime::tracing::warn!("a call was not forwarded: {error}");
        }
        Some(end)
    }

    /// Waits until a call ends, at most for this time, and forwards its reply. It waits before it
    /// looks: a server that was woken on this processor has not run yet.
    pub(crate) fn end_within(&mut self, most: Duration) -> Option<CallEnd> {
        let begin = Instant::now();
        loop {
            let left = most.saturating_sub(begin.elapsed());
            let Some(awaiting) = self.awaiting().filter(|_| !left.is_zero()) else {
                return self.end();
            };
            wait(&[awaiting.descriptor], left);
            if let Some(end) = self.end() {
                return Some(end);
            }
        }
    }

    /// Makes a call, waits for its end and replies.
    pub(crate) fn call(
        &mut self,
        operation: &Operation,
        arguments: &Reader<'_>,
        counts: &ForwardCounts,
        request: &mut Request<'_>,
    ) -> Result<(), HandlerError> {
        let begin = Instant::now();
        let there = std::cell::Cell::new(Duration::ZERO);
        let called = self.client.call_with(
            &operation.wire,
            |writer| {
                pass_arguments(operation, arguments, writer);
                there.set(begin.elapsed());
            },
            |case, reader| {
                let replied = Instant::now();
                let result = pass_reply(operation, case, reader, request);
                counts.note(there.get() + replied.elapsed());
                Ok::<_, CallError>(result)
            },
        );
        request.set_age(self.client.age());
        called.unwrap_or_else(|error| refuse(operation, request, &error))
    }

    /// Sends a command.
    pub(crate) fn send(
        &mut self,
        operation: &Operation,
        arguments: &Reader<'_>,
        counts: &ForwardCounts,
    ) -> Result<(), CallError> {
        let begin = Instant::now();
        let sent = self.client.send_with(&operation.wire, |writer| {
            pass_arguments(operation, arguments, writer);
        });
        counts.note(begin.elapsed());
        sent
    }
}

/// Replies that a call failed.
fn refuse(
    operation: &Operation,
    request: &mut Request<'_>,
    error: &CallError,
) -> Result<(), HandlerError> {
    match error {
        CallError::Unavailable { state } => {
            request.unavailable(&operation.wire, state);
            Ok(())
        }
        CallError::Refused(reason) => request.fail(reason),
        error => request.fail(error),
    }
}

/// Replies with the result of a call, or with an exception.
fn pass_reply(
    operation: &Operation,
    case: i32,
    reader: &Reader<'_>,
    request: &mut Request<'_>,
) -> Result<(), HandlerError> {
    let mut throws = operation.throws.iter();
    let ty = throws.find(|thrown| thrown.id == case);
    let ty = ty.map_or(&operation.reply, |thrown| &thrown.ty);
    let image = reader.clone().image().is_some();
    request.reply_with(case, |writer| {
        // After another envelope, or between variants, the bytes would differ.
        let keeps =
            !image && reader.position() == ENVELOPE_OF_VALUES && writer.len() == ENVELOPE_OF_VALUES;
        copy(ty, reader, keeps, writer);
    })
}

fn pass_arguments(operation: &Operation, arguments: &Reader<'_>, writer: &mut Writer<'_>) {
    let keeps = same_place(arguments, writer);
    copy(&operation.request, arguments, keeps, writer);
}

/// Whether the bytes at a reader may be copied to a writer.
pub(crate) fn same_place(reader: &Reader<'_>, writer: &Writer<'_>) -> bool {
    reader.position() % 8 == writer.len() % 8
}

/// Writes a structure that follows in a reader: its bytes, if `keeps` says so, else its value.
pub(crate) fn copy(ty: &Arc<Struct>, reader: &Reader<'_>, keeps: bool, writer: &mut Writer<'_>) {
    if keeps {
        // An array of bytes is written straight into the memory of a middleware.
        return u8::encode_all(reader.rest(), writer);
    }
    match read(ty, &mut reader.clone()) {
        Ok(value) => write(&value, writer),
        Err(error) => writer.fail(EncodeError::NoValue(error.to_string())),
    }
}
