//! Typed publishers, clients and requests: the layer between generated code and the bytes of a
//! backend. Only this layer and generated code know codecs.

mod call;
mod client;
mod codec;
mod gate;
mod interface;
mod publisher;
mod request;
mod sample;

pub use call::{Call, CallId};
pub use client::{Done, Ended, TypedClient, expect_result, reply_values};
pub use codec::{Arguments, Checked, MOST_PARTS, Put, Returned, Throws, read, reply, result};
pub use gate::Gate;
pub use publisher::TypedPublisher;
pub use request::{DeferredRequest, Request};
pub use sample::Sample;

use crate::cdr::{Cdr, DecodeError, EncodeError, Reader, Writer};
use std::marker::PhantomData;

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
    /// declaration, and then its result, as [`Profile::Bare`](crate::Profile::Bare) orders them. Empty if it throws
    /// nothing.
    pub replies: &'static [ReplyVariant],
}

impl Operation {
    /// A query; `replies` is empty if it throws nothing.
    pub const fn query(
        name: &'static str,
        id: i32,
        type_hash: u64,
        replies: &'static [ReplyVariant],
    ) -> Self {
        Self {
            name,
            id,
            type_hash,
            two_way: true,
            replies,
        }
    }

    /// A command or a topic, which has no reply.
    pub const fn one_way(name: &'static str, id: i32, type_hash: u64) -> Self {
        Self {
            name,
            id,
            type_hash,
            two_way: false,
            replies: &[],
        }
    }
}

/// A variant of a reply. A result of several parts has one variant for each part, all with case 0.
#[derive(Clone, Copy)]
pub struct ReplyVariant {
    /// 0 for the result, else the hash of the exception.
    pub case: i32,
    codec: &'static dyn VariantCodec,
}

/// Writes and skips a variant of a reply.
pub trait VariantCodec: Sync {
    /// Writes the default value.
    fn put(&self, writer: &mut Writer<'_>);

    /// Reads a value and drops it.
    fn skip(&self, reader: &mut Reader<'_>) -> Result<(), DecodeError>;
}

/// The codec of a type that is known when code is compiled.
struct Of<T>(PhantomData<fn() -> T>);

impl<T: Cdr + Default> VariantCodec for Of<T> {
    fn put(&self, writer: &mut Writer<'_>) {
        writer.put(&T::default());
    }

    fn skip(&self, reader: &mut Reader<'_>) -> Result<(), DecodeError> {
        reader.get::<T>().map(drop)
    }
}

impl ReplyVariant {
    /// The variant of the exception `T`; with case 0, of a part of the result.
    pub const fn of<T: Cdr + Default + 'static>(case: i32) -> Self {
        Self::with(case, &const { Of::<T>(PhantomData) })
    }

    /// The variant of an exception, or with case 0 of the result, that `codec` writes.
    pub const fn with(case: i32, codec: &'static dyn VariantCodec) -> Self {
        Self { case, codec }
    }
}

impl std::fmt::Debug for ReplyVariant {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "ReplyVariant({})", self.case)
    }
}

impl PartialEq for ReplyVariant {
    fn eq(&self, other: &Self) -> bool {
        self.case == other.case
    }
}

impl Eq for ReplyVariant {}

/// The code of a reply in [`Profile::Bare`]: 0 for the result, else the number of the exception,
/// from 1.
fn code(replies: &[ReplyVariant], case: i32) -> i32 {
    let at = replies.iter().position(|a| a.case == case && case != 0);
    at.map_or(0, |at| i32::try_from(at + 1).unwrap_or(i32::MAX))
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
        DecodeError::IntegerOutOfRange { what, value, range } => {
            EncodeError::IntegerOutOfRange { what, value, range }
        }
        DecodeError::Invalid(error) => error,
        other => EncodeError::NoValue(other.to_string()),
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
    use crate::backend::{LoanedSample, Publisher};
    use crate::error::SendError;
    use crate::header::{Encoding, Header};
    use crate::rpc::{self, RequestId};
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

    #[test]
    fn a_closed_gate_withholds_samples_and_counts_them() {
        let gate = Gate::default();
        let mut publisher = publisher(false).behind(gate.clone());
        for (open, counts) in [(true, (1, 0)), (false, (1, 1)), (true, (2, 1))] {
            gate.set_open(open);
            let sent = publisher.publish_with(|writer| writer.put(&7_u8));
            assert_eq!(sent, Ok(()));
            assert_eq!((publisher.sent().get(), publisher.withheld().get()), counts);
        }
    }

    /// Lends nothing.
    #[test]
    fn without_loans_a_reply_is_serialized_once() {
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
