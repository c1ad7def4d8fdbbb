//! Calls and publications of a context, on the session of this thread. Arguments were checked
//! against their types.

use crate::Aligned;
use crate::description::{Operation, Program};
use crate::error::HostError;
use crate::replies::undecodable;
use crate::sample::copied;
use crate::session::{self, with};
use crate::wire::{read, write};
use rc_middleware::typed::{TypedClient, expect_result};
use rc_middleware::{CallError, DecodeError, Fresh, Freshness, Reader, SendError};
use rc_runtime::{Awaited, Collected, FreshSlot, LatestSlot};
use rc_values::Value;
use std::sync::Arc;
use std::time::Instant;

/// Reply of a server.
pub enum Answer {
    /// The structure of a reply.
    Result(Value),
    /// The image of a result, which is copied as a whole.
    Image(Aligned),
    /// An exception that the operation declares.
    Exception(Value),
}

/// The form in which a reply is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reading {
    /// As a value.
    Value,
    /// As the image of its only part.
    Image,
}

/// An operation of a slot or of a member, by numbers. The generated layer has no others.
///
/// # Errors
/// There is no such operation, or no session.
pub fn operation(
    program: &Program,
    slot: usize,
    operation: usize,
) -> Result<&Operation, HostError> {
    let described = if slot >= program.slots.len() {
        with(|session| session.described(slot))?
    } else {
        slot
    };
    let found = program.operation(described, operation);
    found.ok_or_else(|| HostError::no_such("operation", slot))
}

/// Waits for a sample of the shared world, or a moment, at most until `until` of the system's time. `None` once
/// nothing more may be awaited.
///
/// # Errors
/// There is no session.
pub fn await_world(until: Instant) -> Result<Option<Awaited>, HostError> {
    // The session is free while it waits.
    let early = with(|session| Ok(session.early_samples()))?;
    Ok(early.next(until))
}

/// Calls a query.
///
/// # Errors
/// The outer one: there is no session, or no such client. The inner one: the call failed.
pub fn query(
    slot: usize,
    operation: &Operation,
    request: &Value,
    reading: Reading,
) -> Result<Result<Answer, CallError>, HostError> {
    with(|session| {
        let client = session.client(slot)?;
        Ok(call(client, operation, request, |reader| match reading {
            Reading::Value => {
                let value = read(&operation.reply, reader);
                value.map(Answer::Result).map_err(undecodable)
            }
            Reading::Image => copied(&operation.reply, reader).map(Answer::Image),
        }))
    })
}

/// Sends a command.
///
/// # Errors
/// As of [`query`].
pub fn command(
    slot: usize,
    operation: &Operation,
    request: &Value,
) -> Result<Result<(), CallError>, HostError> {
    with(|session| {
        let client = session.client(slot)?;
        Ok(client.send_with(&operation.wire, |writer| write(request, writer)))
    })
}

/// Publishes a sample on the topic of an operation.
///
/// # Errors
/// As of [`query`].
pub fn publish(
    slot: usize,
    operation: usize,
    sample: &Value,
) -> Result<Result<(), SendError>, HostError> {
    with(|session| {
        let publisher = session.publisher(slot, operation)?;
        Ok(publisher.publish_with(|writer| write(sample, writer)))
    })
}

/// Publishes a sample that is encoded already.
///
/// # Errors
/// As of [`query`].
pub fn publish_encoded(
    slot: usize,
    operation: usize,
    sample: &[u8],
) -> Result<Result<(), SendError>, HostError> {
    with(|session| {
        let publisher = session.publisher(slot, operation)?;
        Ok(publisher.publish_with(|writer| writer.raw(sample)))
    })
}

/// The newest sample of a topic, as the structure of its values, with its age.
///
/// # Errors
/// The outer one: no function of the worker runs. The inner one: there is no sample that may be used.
pub fn newest(
    slot: usize,
    number: usize,
    operation: &Operation,
) -> Result<Result<Fresh<Value>, CallError>, HostError> {
    session::with_core(|core| {
        FreshSlot::new(core, slot).newest(number, |reader| {
            read(&operation.request, reader).map_err(undecodable)
        })
    })
}

/// Sets the reply that answers a query from now on, without a handler.
///
/// # Errors
/// The outer one: no function of the worker runs. The inner one: the last reply stays.
pub fn set_latest(
    slot: usize,
    number: usize,
    reply: Value,
) -> Result<Result<(), SendError>, HostError> {
    session::with_core(|core| LatestSlot::new(core, slot).set(number, reply, write))
}

/// The age of the last reply of a slot. `None` before the first one, and for a slot that keeps no
/// ages.
///
/// # Errors
/// There is no session, or no such client.
pub fn freshness(slot: usize) -> Result<Option<Freshness>, HostError> {
    with(|session| Ok(session.client(slot)?.freshness()))
}

/// The values of a sample that was collected, with their age.
///
/// # Errors
/// It is not of its type.
pub fn collected(operation: &Operation, sample: &Collected) -> Result<Fresh<Value>, DecodeError> {
    sample.read(|reader| read(&operation.request, reader).map_err(undecodable))
}

/// Calls a query. `result` reads the result, unless there is none.
fn call(
    client: &mut TypedClient,
    operation: &Operation,
    request: &Value,
    result: impl FnOnce(&mut Reader<'_>) -> Result<Answer, DecodeError>,
) -> Result<Answer, CallError> {
    let answer = |case, reader: &mut Reader<'_>| {
        if let Some(thrown) = operation.throws.iter().find(|thrown| thrown.id == case) {
            return read(&thrown.ty, reader)
                .map(Answer::Exception)
                .map_err(|error| CallError::Malformed(undecodable(error)));
        }
        expect_result(case)?;
        if operation.reply.members.is_empty() {
            let empty = Value::Struct(Arc::clone(&operation.reply), Vec::new());
            return Ok(Answer::Result(empty));
        }
        result(reader).map_err(CallError::Malformed)
    };
    client.call_with(&operation.wire, |writer| write(request, writer), answer)
}
