//! The envelope of a call.
//!
//! It is the basic service mapping of OMG DDS-RPC 1.0 (formal/16-12-04, 7.5.1.1): a request is `{
//! RequestHeader, union switch (int32 operation) { case HASH: In } }`, a reply is `{ ReplyHeader,
//! union switch (int32 operation) { case HASH: union switch (int32) { case 0: Out; case HASH:
//! exception } } }`. The hash of a name is the first four bytes of its MD5 sum, as a little-endian
//! int32. `In` holds the input parameters. `Out` holds the output parameters and then the return
//! value. An empty structure holds one octet. If the header of a reply says that nothing was
//! executed, a text with the reason follows the (unknown) branch of the union. If the server does
//! not serve the operation in its present state, a second text names that state.
//!
//! In [`Profile::Bare`] no envelope travels: the backend adds it to a received body, which
//! then begins at [`ENVELOPE`], and removes it before it sends.
//!
//! ```
//! use rc_middleware::rpc::{RequestId, begin_request, open_request};
//! use rc_middleware::{Reader, Writer};
//!
//! let id = RequestId {
//!     writer: [7; 16],
//!     sequence: 1,
//! };
//! let mut writer = Writer::default();
//! begin_request(&mut writer, id, 5);
//! writer.put(&42_i32); // the body of the operation with the hash 5
//! let bytes = writer.finish().expect("an encoded request");
//!
//! let mut reader = Reader::new(bytes);
//! assert_eq!(open_request(&mut reader), Ok((id, 5)));
//! assert_eq!(reader.get(), Ok(42_i32));
//! ```

use crate::cdr::{DecodeError, Reader, Writer};
use crate::profile::Profile;
use rc_diagnostics::foreign::clean;

/// Identifies a request by client GUID and sequence number, from 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct RequestId {
    /// The client.
    pub writer: [u8; 16],
    /// The sequence number, from 1.
    pub sequence: u64,
}

/// `dds::rpc::RemoteExceptionCode_t`
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// Executed; the reply holds a result or an exception of the interface.
    Ok = 0,
    /// The server does not support the operation.
    Unsupported = 1,
    /// The server does not accept an argument.
    InvalidArgument = 2,
    /// The server lacks resources for it now.
    OutOfResources = 3,
    /// The interface of the server does not have the operation.
    UnknownOperation = 4,
    /// The server failed with an error that its interface does not declare.
    UnknownException = 5,
}

/// Offset of the body of a call in [`Profile::Bare`]: a multiple of all alignments, so that the
/// bytes of the body do not depend on the envelope.
pub const ENVELOPE: usize = 40;

/// Length of the envelope of a request, and of a reply that holds a result, in [`Profile::Rpc`].
pub const ENVELOPE_OF_VALUES: usize = 36;

/// Length of the identity of a request, with which the envelopes of a request and of its reply
/// begin.
pub const IDENTITY: usize = 24;

/// The envelope in front of the value of a call.
pub(crate) type Envelope = [u8; ENVELOPE_OF_VALUES];

/// Writes the padding between an envelope and its body in `profile`.
pub fn begin_body(writer: &mut Writer<'_>, profile: Profile) {
    if profile == Profile::Bare {
        writer.align(8);
    }
}

/// Skips the padding behind an envelope that was read.
pub fn open_body(reader: &mut Reader<'_>, profile: Profile) {
    if profile == Profile::Bare {
        reader.align(8);
    }
}

/// Writes the envelope of a request.
pub fn begin_request(writer: &mut Writer<'_>, id: RequestId, operation: i32) {
    identity(writer, id);
    crate::cdr::text("", writer);
    writer.put(&operation);
}

/// Reads the envelope of a request: its identity and its operation.
pub fn open_request(reader: &mut Reader<'_>) -> Result<(RequestId, i32), DecodeError> {
    let id = open_identity(reader)?;
    reader.text()?;
    Ok((id, reader.get()?))
}

/// The operation of a request, and the byte where its parameters begin.
pub fn request_values(envelope: &[u8], profile: Profile) -> Result<(i32, usize), DecodeError> {
    let mut reader = Reader::new(envelope);
    let (_, operation) = open_request(&mut reader)?;
    open_body(&mut reader, profile);
    Ok((operation, reader.position()))
}

/// The identity of a request, or of the request that a reply belongs to; `None` for too few bytes.
pub fn request_id(envelope: &[u8]) -> Option<RequestId> {
    open_identity(&mut Reader::new(envelope)).ok()
}

/// Writes the envelope of a reply. `case` is A result (0), or the exception with this hash.
pub fn begin_reply(writer: &mut Writer<'_>, id: RequestId, operation: i32, case: i32) {
    identity(writer, id);
    writer.put(&(Outcome::Ok as i32));
    writer.put(&operation);
    writer.put(&case);
}

/// Writes a whole reply which says that nothing was executed, and why.
pub fn refuse(writer: &mut Writer<'_>, id: RequestId, outcome: Outcome, reason: &str) {
    identity(writer, id);
    writer.put(&(outcome as i32));
    writer.put(&0_i32);
    writer.put(&0_u8);
    put_reason(writer, reason, None);
}

/// Writes a whole reply which says that the server does not serve the operation in `state`.
pub fn refuse_in(writer: &mut Writer<'_>, id: RequestId, state: &str) {
    identity(writer, id);
    writer.put(&(Outcome::Unsupported as i32));
    writer.put(&0_i32);
    writer.put(&0_u8);
    put_reason(writer, &not_served_in(state), Some(state));
}

/// The reason of a refusal in a state.
pub fn not_served_in(state: &str) -> String {
    format!("not served in the state `{state}`")
}

/// Writes the reason of a refusal, and the state that refuses.
pub fn put_reason(writer: &mut Writer<'_>, reason: &str, state: Option<&str>) {
    for text in [Some(reason), state].into_iter().flatten() {
        crate::cdr::text(&text.replace('\0', " "), writer);
    }
}

/// Reads the reason of a refusal, and the state that refuses, if one does. The texts are cleaned.
pub fn read_reason(reader: &mut Reader<'_>) -> (Option<String>, Option<String>) {
    let mut next = || {
        reader
            .text()
            .ok()
            .map(clean)
            .filter(|text| !text.is_empty())
    };
    (next(), next())
}

/// Content of a reply.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ReplyKind {
    /// 0 for a result, else the hash of an exception.
    Case(i32),
    /// Nothing was executed; the reason.
    Refused(String),
    /// Nothing was executed, because the server does not serve the operation in this state.
    Unavailable(String),
}

/// Reads the envelope of the reply to `operation`.
pub fn open_reply(
    reader: &mut Reader<'_>,
    operation: i32,
) -> Result<(RequestId, ReplyKind), DecodeError> {
    let id = open_identity(reader)?;
    let outcome: i32 = reader.get()?;
    let found: i32 = reader.get()?;
    if outcome == Outcome::Ok as i32 {
        if found != operation {
            return Err(DecodeError::Unknown("operation in the reply"));
        }
        return Ok((id, ReplyKind::Case(reader.get()?)));
    }
    let (reason, state) = match reader.get::<u8>() {
        Ok(_) => read_reason(reader),
        Err(_) => (None, None),
    };
    if let Some(state) = state.filter(|_| outcome == Outcome::Unsupported as i32) {
        return Ok((id, ReplyKind::Unavailable(state)));
    }
    let known = match outcome {
        1 => "not supported",
        2 => "invalid argument",
        3 => "out of resources",
        4 => "unknown operation",
        _ => "it failed",
    };
    Ok((
        id,
        ReplyKind::Refused(reason.unwrap_or_else(|| known.to_owned())),
    ))
}

/// `dds::SampleIdentity`: a GUID and a sequence number in two halves, the high one first.
fn identity(writer: &mut Writer<'_>, id: RequestId) {
    writer.raw(&id.writer);
    writer.put(&((id.sequence >> 32) as i32));
    writer.put(&(id.sequence as u32));
}

fn open_identity(reader: &mut Reader<'_>) -> Result<RequestId, DecodeError> {
    let mut writer = [0; 16];
    writer.copy_from_slice(reader.raw(16)?);
    let high: i32 = reader.get()?;
    let low: u32 = reader.get()?;
    Ok(RequestId {
        writer,
        sequence: (high as u64) << 32 | u64::from(low),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_body_without_its_envelope_has_the_same_bytes() {
        let (mut request, mut reply) = (Writer::default(), Writer::default());
        begin_request(&mut request, RequestId::default(), 3);
        begin_reply(&mut reply, RequestId::default(), 3, 0);
        for writer in [&mut request, &mut reply] {
            begin_body(writer, Profile::Bare);
            assert_eq!(writer.len(), ENVELOPE);
        }
        let bytes = request.into_bytes();
        let mut reader = Reader::new(&bytes);
        open_request(&mut reader).expect("an envelope");
        open_body(&mut reader, Profile::Bare);
        assert!(reader.rest().is_empty());
    }

    #[test]
    fn a_reason_is_truncated_and_escaped() {
        let mut writer = Writer::default();
        let long = format!("no\nerror: forged\u{1b}[2J{}", "x".repeat(1 << 20));
        refuse(
            &mut writer,
            RequestId::default(),
            Outcome::UnknownException,
            &long,
        );
        let bytes = writer.into_bytes();
        let (_, reply) = open_reply(&mut Reader::new(&bytes), 3).expect("a reply");
        let ReplyKind::Refused(reason) = reply else {
            panic!("{reply:?}");
        };
        assert!(
            reason.starts_with("no\\nerror: forged\\u{1b}[2Jxxx"),
            "{reason}"
        );
        assert_eq!(reason.chars().count(), 257);
    }

    #[test]
    fn decoding_restores_an_envelope() {
        let id = RequestId {
            writer: [7; 16],
            sequence: 1 << 33 | 5,
        };
        let mut writer = Writer::default();
        begin_request(&mut writer, id, -9);
        assert_eq!(
            writer.len(),
            36,
            "16 + 8 bytes of identity, an empty string, padding, the discriminator"
        );
        assert_eq!(
            open_request(&mut Reader::new(&writer.into_bytes())),
            Ok((id, -9))
        );
        let mut writer = Writer::default();
        refuse(&mut writer, id, Outcome::InvalidArgument, "too fast");
        let bytes = writer.into_bytes();
        let reply = open_reply(&mut Reader::new(&bytes), -9);
        assert_eq!(reply, Ok((id, ReplyKind::Refused("too fast".to_owned()))));
        let mut writer = Writer::default();
        refuse_in(&mut writer, id, "idle");
        let bytes = writer.into_bytes();
        let reply = open_reply(&mut Reader::new(&bytes), -9);
        assert_eq!(reply, Ok((id, ReplyKind::Unavailable("idle".to_owned()))));
        // A program that knows the mapping only reads the code.
        assert_eq!(bytes[24..28], (Outcome::Unsupported as i32).to_le_bytes());
    }
}
