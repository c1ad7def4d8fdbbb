//! Calls and publications for a language that encodes and decodes values itself: bodies of CDR, which are checked
//! against their types and copied, without values between.

use crate::description::Operation;
use crate::error::HostError;
use crate::replies::undecodable;
use crate::session::{with, with_core};
use crate::wire;
use rc_middleware::typed::{Call, Ended, expect_result};
use rc_middleware::{CallError, DecodeError, EncodeError, Fresh, Reader, SendError, Writer};
use rc_runtime::{Collected, FreshSlot};
use rc_values::Struct;
use std::sync::Arc;

/// Reply of a server.
pub struct Reply {
    /// 0 for a result, else the hash of an exception that the operation declares.
    pub case: i32,
    /// Its structure in CDR.
    pub body: Vec<u8>,
}

/// Writes a body of this type. The error of one that does not fit names `what`.
pub fn write(ty: &Struct, body: &[u8], what: &str, writer: &mut Writer<'_>) {
    if let Err(error) = rc_values::copy(ty, &mut Reader::new(body), writer) {
        writer.fail(EncodeError::NoValue(format!("{what}(): {error}")));
    }
}

/// Reads a structure in either encoding: its body in the message, or a copy in `room`.
///
/// # Errors
/// It is not of its type.
pub fn read<'b, 'm: 'b>(
    ty: &Arc<Struct>,
    reader: &mut Reader<'m>,
    room: &'b mut Vec<u8>,
) -> Result<&'b [u8], DecodeError> {
    if let Some(body) = rc_values::borrow(ty, reader) {
        return Ok(body);
    }
    room.clear();
    let mut writer = Writer::over(std::mem::take(room));
    let copied = wire::copy(ty, reader, &mut writer).map_err(undecodable);
    let written = writer.finish().map(drop).map_err(DecodeError::from);
    *room = writer.into_bytes();
    copied.and(written)?;
    Ok(room)
}

/// Calls a query.
///
/// # Errors
/// The outer one: there is no session, or no such client. The inner one: the call failed.
pub fn query(
    slot: usize,
    operation: &Operation,
    request: &[u8],
) -> Result<Result<Reply, CallError>, HostError> {
    with(|session| {
        let client = session.client(slot)?;
        Ok(client.call_with(
            &operation.wire,
            |writer| write(&operation.request, request, &operation.name, writer),
            |case, reader| reply(operation, case, reader),
        ))
    })
}

/// Sends a command.
///
/// # Errors
/// As of [`query`].
pub fn command(
    slot: usize,
    operation: &Operation,
    request: &[u8],
) -> Result<Result<(), CallError>, HostError> {
    with(|session| {
        let client = session.client(slot)?;
        Ok(client.send_with(&operation.wire, |writer| {
            write(&operation.request, request, &operation.name, writer);
        }))
    })
}

/// Starts a query, whose result will be an `R`, and returns at once.
///
/// # Errors
/// As of [`query`].
pub fn start<R>(
    slot: usize,
    operation: &Operation,
    request: &[u8],
) -> Result<Result<Call<R, CallError>, CallError>, HostError> {
    with(|session| {
        let client = session.client(slot)?;
        Ok(client.start_with(&operation.wire, |writer| {
            write(&operation.request, request, &operation.name, writer);
        }))
    })
}

/// The reply to a query that was started and has ended.
///
/// # Errors
/// The call failed.
pub fn ended(operation: &Operation, ended: Ended<'_>) -> Result<Reply, CallError> {
    ended.read(|case, reader| reply(operation, case, reader))?
}

/// Publishes a sample on the topic of an operation. A small one is sent as it is, if it is checked at once.
///
/// # Errors
/// As of [`query`].
pub fn publish(
    slot: usize,
    number: usize,
    sample: &[u8],
) -> Result<Result<(), SendError>, HostError> {
    with(|session| {
        let (operation, publisher) = session.topic(slot, number)?;
        if let Some(body) = rc_values::borrow(&operation.request, &mut Reader::new(sample)) {
            return Ok(publisher.publish_body(body));
        }
        Ok(publisher.publish_with(|writer| {
            write(&operation.request, sample, &operation.name, writer);
        }))
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
) -> Result<Result<Fresh<Vec<u8>>, CallError>, HostError> {
    with_core(|core| {
        FreshSlot::new(core, slot).newest(number, |reader| copied(&operation.request, reader))
    })
}

/// The body of a sample that was collected, with its age.
///
/// # Errors
/// It is not of its type.
pub fn collected(operation: &Operation, sample: &Collected) -> Result<Fresh<Vec<u8>>, DecodeError> {
    sample.read(|reader| copied(&operation.request, reader))
}

/// Copies a structure in either encoding.
fn copied(ty: &Arc<Struct>, reader: &mut Reader<'_>) -> Result<Vec<u8>, DecodeError> {
    let mut writer = Writer::over(Vec::with_capacity(reader.rest().len()));
    wire::copy(ty, reader, &mut writer).map_err(undecodable)?;
    writer.finish()?;
    Ok(writer.into_bytes())
}

/// Reads the variant of a reply.
fn reply(operation: &Operation, case: i32, reader: &mut Reader<'_>) -> Result<Reply, CallError> {
    let mut body = Vec::new();
    let thrown = operation.throws.iter().find(|thrown| thrown.id == case);
    let ty = if let Some(thrown) = thrown {
        &thrown.ty
    } else {
        expect_result(case)?;
        &operation.reply
    };
    // A reply of an operation that throws may lack the octet of an empty structure.
    if thrown.is_some() || !operation.reply.members.is_empty() {
        body = copied(ty, reader).map_err(CallError::Malformed)?;
    }
    Ok(Reply { case, body })
}
