//! Replies to calls: their envelope, their result or exception.

use super::super::call::CallId;
use super::super::{Operation, ReplyVariant, Returned, Throws, code, result};
use super::Done;
use crate::backend::{Client, Profile};
use crate::cdr::{DecodeError, Reader};
use crate::error::CallError;
use crate::header::{Encoding, Header};
use crate::in_place::BEHIND_ENVELOPE;
use crate::rpc::{self, ReplyKind, RequestId};
use crate::shared_value::Message;
use std::time::Duration;

/// The reply to a started call, or why there is none.
pub struct Ended<'r> {
    /// The call.
    pub id: CallId,
    /// The discriminator of its operation.
    pub operation: i32,
    /// How old the value of the reply was when the call began; zero for a new one, and where the
    /// middleware does not say.
    pub age: Duration,
    reply: Result<(i32, Reader<'r>), CallError>,
}

impl Ended<'_> {
    /// The place of its operation in `operations`.
    pub fn place(&self, operations: &[Operation]) -> Option<usize> {
        operations.iter().position(|of| of.id == self.operation)
    }

    /// Whether the call ended at its deadline, without a reply.
    pub fn is_late(&self) -> bool {
        matches!(self.reply, Err(CallError::Deadline { .. }))
    }

    /// The result, for an operation whose exceptions are those of `E`.
    pub fn result<R: Returned, E: Throws>(self) -> Result<R, E> {
        self.result_with(result)
    }

    /// Hands 0 for a result or the hash of an exception, and what follows it, to `read`.
    ///
    /// # Errors
    /// The call has no reply.
    pub fn read<T>(self, read: impl FnOnce(i32, &mut Reader<'_>) -> T) -> Result<T, CallError> {
        let (case, mut reader) = self.reply?;
        Ok(read(case, &mut reader))
    }

    /// [`Ended::result`], which `read` reads.
    fn result_with<R, E: Throws>(
        self,
        read: impl FnOnce(&mut Reader<'_>) -> Result<R, DecodeError>,
    ) -> Result<R, E> {
        let (case, mut reader) = self.reply?;
        read_reply(case, &mut reader, read)
    }

    /// Reads the result with `read`, for `done` to handle when the memory of the reply is free.
    pub fn then<W, C, R: 'static, E: Throws + 'static>(
        self,
        read: impl FnOnce(&mut Reader<'_>) -> Result<R, DecodeError>,
        done: impl FnOnce(&mut W, &mut C, CallId, Result<R, E>) + 'static,
    ) -> Option<Done<W, C>> {
        let id = self.id;
        let result = self.result_with(read);
        Some(Box::new(move |worker: &mut W, ctx: &mut C| {
            done(worker, ctx, id, result);
        }))
    }
}

/// Reads a result with `read`, or the exception of a reply.
pub(super) fn read_reply<R, E: Throws>(
    case: i32,
    reader: &mut Reader<'_>,
    read: impl FnOnce(&mut Reader<'_>) -> Result<R, DecodeError>,
) -> Result<R, E> {
    if case == 0 {
        return read(reader).map_err(|error| CallError::from(error).into());
    }
    let thrown = E::read(case, reader);
    Err(thrown.unwrap_or_else(|error| CallError::from(error).into()))
}

/// The request that a reply belongs to.
#[derive(Clone, Copy)]
pub(super) struct PendingCall {
    pub(super) id: RequestId,
    pub(super) operation: i32,
    pub(super) type_hash: u64,
    pub(super) profile: Profile,
    pub(super) replies: &'static [ReplyVariant],
    /// When it was sent; 0 if replies have no ages.
    pub(super) asked: u64,
}

impl PendingCall {
    pub(super) fn ended(
        self,
        age: Duration,
        reply: Result<(i32, Reader<'_>), CallError>,
    ) -> Ended<'_> {
        Ended {
            id: CallId(self.id),
            operation: self.operation,
            age,
            reply,
        }
    }

    /// Its request is sent now.
    pub(super) fn sent(&mut self, port: &dyn Client, header: Header) {
        if port.replies_have_ages() {
            self.asked = header.sent;
        }
    }

    /// How old the value of its reply was when the call began.
    pub(super) fn age(self, reply: Header) -> Duration {
        match reply.sent {
            0 => Duration::ZERO,
            sent => Duration::from_nanos(self.asked.saturating_sub(sent)),
        }
    }
}

/// Opens the envelope of a reply.
pub(super) fn open<'m>(
    message: &'m Message<'_>,
    header: Header,
    pending: PendingCall,
) -> Result<(i32, Reader<'m>), CallError> {
    // The envelope is always CDR.
    let mut reader = message.reader(Encoding::Cdr);
    match rpc::open_reply(&mut reader, pending.operation)? {
        (id, _) if id != pending.id => Err(DecodeError::Unknown("request in the reply").into()),
        (_, ReplyKind::Refused(reason)) => Err(CallError::Refused(reason)),
        (_, ReplyKind::Unavailable(state)) => Err(CallError::Unavailable { state }),
        (_, ReplyKind::Case(case)) => {
            if header.encoding == Encoding::Image {
                // A memory image is read only if its sender has the same types.
                if header.type_hash != pending.type_hash {
                    return Err(DecodeError::Unknown("type in the reply").into());
                }
                reader.image_at(BEHIND_ENVELOPE);
            }
            if pending.profile == Profile::Bare {
                rpc::open_body(&mut reader, pending.profile);
                let case = open_bare_reply(&mut reader, pending.replies)?;
                return Ok((case, reader));
            }
            Ok((case, reader))
        }
    }
}

/// The values that a reply to `operation` holds, 0 for a result or the hash of an exception, and the
/// byte where they begin. `None` if nothing was executed.
///
/// # Errors
/// The reply belongs to another operation, or its bytes are damaged.
pub fn reply_values(
    operation: &Operation,
    profile: Profile,
    header: Header,
    body: &[u8],
) -> Result<Option<(i32, usize)>, DecodeError> {
    let mut reader = Reader::new(body);
    let (_, ReplyKind::Case(case)) = rpc::open_reply(&mut reader, operation.id)? else {
        return Ok(None);
    };
    if header.encoding == Encoding::Image {
        return Ok(Some((case, BEHIND_ENVELOPE)));
    }
    if profile == Profile::Bare {
        rpc::open_body(&mut reader, profile);
        let case = open_bare_reply(&mut reader, operation.replies)?;
        return Ok(Some((case, reader.position())));
    }
    Ok(Some((case, reader.position())))
}

/// Skips to the variant that a reply in [`Profile::Bare`] holds, and gives its case.
fn open_bare_reply(reader: &mut Reader<'_>, replies: &[ReplyVariant]) -> Result<i32, DecodeError> {
    if replies.is_empty() {
        return Ok(0);
    }
    let found: i32 = reader.get()?;
    for variant in replies.iter().filter(|variant| variant.case != 0) {
        if code(replies, variant.case) == found {
            return Ok(variant.case);
        }
        variant.codec.skip(reader)?;
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
