//! Messages that are values: between components of one process nothing is encoded.
//!
//! The sender of such a message makes a value of its parameters, which it has checked. Each
//! receiver takes this value, or a clone while others have it. A receiver of other types, or one
//! that needs bytes, gets the encoding. The sender makes it at most once for all of its middlewares,
//! a receiver for itself: a message that waits in a queue grows no more.

use crate::cdr::{EncodeError, Reader, Writer, allocation};
use crate::header::Encoding;
use crate::rpc::{ENVELOPE_OF_VALUES, Envelope, IDENTITY};
use crate::typed::{Put, Returned};
use std::any::Any;
use std::cell::{Cell, OnceCell};
use std::sync::{Arc, OnceLock};

/// A body that receivers of this process share as a value.
///
/// ```
/// use rc_middleware::shared_value::{HeldValue, SharedValue};
/// use rc_middleware::typed;
///
/// let body = SharedValue::of(("front", &7_i32)).expect("a value within its bounds");
/// assert_eq!(body.len(), body.bytes().len());
/// let received = HeldValue::from(body);
/// let read = typed::read::<(String, i32)>(&mut received.reader());
/// assert_eq!(read, Ok(("front".to_owned(), 7)));
/// ```
#[derive(Clone)]
pub struct SharedValue(Arc<dyn Body>);

/// A [`Typed`] without its type.
trait Body: Any + Send + Sync {
    fn envelope(&self) -> Option<&Envelope>;

    fn length(&self) -> usize;

    fn memory(&self) -> usize;

    fn bytes(&self) -> &[u8];

    fn to_bytes(&self) -> Vec<u8>;

    fn into_any(self: Arc<Self>) -> Arc<dyn Any + Send + Sync>;
}

struct Typed<T> {
    /// `None` for a sample.
    envelope: Option<Envelope>,
    value: T,
    write: fn(&T, &mut Writer<'_>),
    /// Length of envelope and value, encoded.
    length: usize,
    /// Memory of the value in bytes, without its encoding.
    memory: usize,
    /// The encoding, once the sender needs it.
    bytes: OnceLock<Vec<u8>>,
}

impl<T: Send + Sync + 'static> Body for Typed<T> {
    fn envelope(&self) -> Option<&Envelope> {
        self.envelope.as_ref()
    }

    fn length(&self) -> usize {
        self.length
    }

    fn memory(&self) -> usize {
        let encoded = self.bytes.get().map_or(0, Vec::capacity);
        self.memory.saturating_add(allocation(encoded))
    }

    fn bytes(&self) -> &[u8] {
        self.bytes.get_or_init(|| self.encode())
    }

    fn to_bytes(&self) -> Vec<u8> {
        self.bytes.get().cloned().unwrap_or_else(|| self.encode())
    }

    fn into_any(self: Arc<Self>) -> Arc<dyn Any + Send + Sync> {
        self
    }
}

impl<T> Typed<T> {
    fn encode(&self) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(self.length);
        bytes.extend(self.envelope.iter().flatten());
        let mut writer = Writer::over(bytes);
        (self.write)(&self.value, &mut writer);
        // Its sender has checked it.
        writer.into_bytes()
    }
}

impl SharedValue {
    /// The body of a sample with these parameters.
    ///
    /// # Errors
    /// They cannot be encoded.
    pub fn of<P: Put>(parameters: P) -> Result<Self, EncodeError> {
        Self::behind(None, parameters)
    }

    /// The body with these parameters; for a call, after its envelope.
    pub(crate) fn behind<P: Put>(
        envelope: Option<Envelope>,
        parameters: P,
    ) -> Result<Self, EncodeError> {
        let size = measure(envelope.as_ref(), false, |writer| parameters.put(writer))?;
        Ok(Self::new(envelope, parameters.own(), Returned::write, size))
    }

    /// The body with a result after its envelope.
    pub(crate) fn of_result<T: Send + Sync + 'static>(
        envelope: Envelope,
        result: T,
        write: fn(&T, &mut Writer<'_>),
    ) -> Result<Self, EncodeError> {
        let size = measure(Some(&envelope), true, |writer| write(&result, writer))?;
        Ok(Self::new(Some(envelope), result, write, size))
    }

    fn new<T: Send + Sync + 'static>(
        envelope: Option<Envelope>,
        value: T,
        write: fn(&T, &mut Writer<'_>),
        size: Size,
    ) -> Self {
        // The counters of an `Arc` are before its content.
        let own = allocation(size_of::<Typed<T>>() + 2 * size_of::<usize>());
        Self(Arc::new(Typed {
            envelope,
            value,
            write,
            length: size.length,
            memory: own.saturating_add(size.memory),
            bytes: OnceLock::new(),
        }))
    }

    /// Length of the encoding, in bytes.
    pub fn len(&self) -> usize {
        self.0.length()
    }

    /// Whether the encoding is empty.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The memory that the value takes with its encoding, if there is one, in bytes.
    pub fn memory(&self) -> usize {
        self.0.memory()
    }

    /// The encoding, which the first call makes for all owners. For the sender, before it hands the
    /// value over: from then on its memory is counted.
    pub fn bytes(&self) -> &[u8] {
        self.0.bytes()
    }

    /// The encoding for one receiver.
    pub fn to_bytes(&self) -> Vec<u8> {
        self.0.to_bytes()
    }

    fn is<T: 'static>(&self) -> bool {
        let body: &dyn Any = &*self.0;
        body.is::<Typed<T>>()
    }

    /// The value, if it is a `T`. Only the last owner gets it without a clone.
    fn into_value<T: Clone + Send + Sync + 'static>(self) -> Option<T> {
        let typed = self.0.into_any().downcast::<Typed<T>>().ok()?;
        Some(match Arc::try_unwrap(typed) {
            Ok(typed) => typed.value,
            Err(shared) => shared.value.clone(),
        })
    }
}

impl std::fmt::Debug for SharedValue {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "SharedValue({} bytes)", self.len())
    }
}

/// The size of a message, in bytes.
#[derive(Clone, Copy)]
struct Size {
    /// Length of envelope and value, encoded.
    length: usize,
    /// Memory of the value.
    memory: usize,
}

/// The size of a body after its envelope, which is sent itself (`is_moved`) or copied. It fails if
/// the body cannot be encoded.
fn measure(
    envelope: Option<&Envelope>,
    is_moved: bool,
    write: impl FnOnce(&mut Writer<'_>),
) -> Result<Size, EncodeError> {
    let mut writer = Writer::counting(envelope.map_or(0, |envelope| envelope.len()), is_moved);
    write(&mut writer);
    writer.finish()?;
    Ok(Size {
        length: writer.len(),
        memory: writer.memory(),
    })
}

/// A received message.
#[derive(Debug)]
pub enum Message<'a> {
    /// In the memory of the middleware.
    Bytes(&'a [u8]),
    /// From a sender in this process.
    Value(HeldValue),
}

impl Message<'_> {
    /// The encoded message.
    pub fn bytes(&self) -> &[u8] {
        match self {
            Self::Bytes(bytes) => bytes,
            Self::Value(value) => value.bytes(),
        }
    }

    /// The beginning of the encoded message: at least the envelope of a call.
    pub fn begin(&self) -> &[u8] {
        match self {
            Self::Bytes(bytes) => bytes,
            Self::Value(value) => value.envelope(),
        }
    }

    /// Length of the encoded message, in bytes.
    pub fn length(&self) -> usize {
        match self {
            Self::Bytes(bytes) => bytes.len(),
            Self::Value(value) => value.len(),
        }
    }

    /// Reads the message, whose bytes have this encoding, from its start.
    pub fn reader(&self, encoding: Encoding) -> Reader<'_> {
        match self {
            Self::Bytes(bytes) => Reader::of(bytes, encoding),
            Self::Value(value) => value.reader(),
        }
    }
}

/// A [`SharedValue`] at one of its receivers, or at its sender, who passes it on.
pub struct HeldValue {
    envelope: Option<Envelope>,
    length: usize,
    value: Cell<Option<SharedValue>>,
    /// Its bytes, once somebody needs them.
    encoded: OnceCell<Vec<u8>>,
}

impl std::fmt::Debug for HeldValue {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "HeldValue({} bytes)", self.length)
    }
}

impl From<SharedValue> for HeldValue {
    fn from(value: SharedValue) -> Self {
        Self {
            envelope: value.0.envelope().copied(),
            length: value.len(),
            value: Cell::new(Some(value)),
            encoded: OnceCell::new(),
        }
    }
}

impl HeldValue {
    /// A reply that answers another request, too, whose identity this is.
    pub fn again(reply: SharedValue, identity: [u8; IDENTITY]) -> Self {
        let mut held = Self::from(reply);
        if let Some(begin) = held.envelope.as_mut().and_then(|all| all.first_chunk_mut()) {
            *begin = identity;
        }
        held
    }

    /// Reads the message from its start.
    pub fn reader(&self) -> Reader<'_> {
        Reader::of_value(self)
    }

    /// Length of the encoding, in bytes.
    pub(crate) fn len(&self) -> usize {
        self.length
    }

    /// The envelope of a call; empty for a sample.
    pub(crate) fn envelope(&self) -> &[u8] {
        self.envelope.as_ref().map_or(&[], |envelope| envelope)
    }

    /// The encoding. Empty if the value was taken before somebody needed it.
    pub fn bytes(&self) -> &[u8] {
        self.encoded.get_or_init(|| {
            let value = self.value.take();
            let bytes = value.as_ref().map(SharedValue::to_bytes);
            self.value.set(value);
            let mut bytes = bytes.unwrap_or_default();
            if let (Some(own), Some(begin)) = (
                &self.envelope,
                bytes.first_chunk_mut::<ENVELOPE_OF_VALUES>(),
            ) {
                begin.copy_from_slice(own);
            }
            bytes
        })
    }

    /// The value, of which this one stays the owner, too. `None` after it was taken.
    pub fn shared(&self) -> Option<SharedValue> {
        let value = self.value.take();
        self.value.set(value.clone());
        value
    }

    /// The value for another receiver, once.
    pub(crate) fn share(&self) -> Option<SharedValue> {
        self.value.take()
    }

    /// The value, if it is a `T`, once.
    pub(crate) fn take<T: Clone + Send + Sync + 'static>(&self) -> Option<T> {
        let value = self.value.take()?;
        if value.is::<T>() {
            return value.into_value();
        }
        self.value.set(Some(value));
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cdr::{Cdr, DecodeError};
    use crate::typed;

    fn received(body: &SharedValue) -> HeldValue {
        HeldValue::from(body.clone())
    }

    #[test]
    fn the_last_receiver_gets_the_value_itself() {
        let numbers = vec![1_u32, 2, 3];
        let body = SharedValue::of((&numbers[..],)).expect("a value");
        let typed: &dyn Any = &*body.0;
        let typed = typed.downcast_ref::<Typed<(Vec<u32>,)>>();
        let written = typed.expect("numbers").value.0.as_ptr();
        let (first, last) = (received(&body), HeldValue::from(body));
        let place = |of: &HeldValue| {
            let (read,) = typed::read::<(Vec<u32>,)>(&mut of.reader()).expect("numbers");
            assert_eq!(read, numbers);
            read.as_ptr()
        };
        assert_ne!(place(&first), written, "the other one still has it");
        assert_eq!(place(&last), written);
    }

    #[test]
    fn a_receiver_of_other_types_reads_the_bytes() {
        let body = SharedValue::of((&7_u8, &8_u32, "x")).expect("a value");
        let mut writer = Writer::default();
        (&7_u8, &8_u32, "x").put(&mut writer);
        let bytes = writer.into_bytes();
        assert_eq!((body.bytes(), body.len()), (&bytes[..], bytes.len()));
        let of = received(&body);
        let read: Result<(u8, u32), DecodeError> = typed::read(&mut of.reader());
        assert_eq!(read, Ok((7, 8)));
        // One part after the other, aligned.
        let of = received(&body);
        let mut reader = of.reader();
        assert_eq!(reader.get::<u8>(), Ok(7));
        assert_eq!(reader.get::<u32>(), Ok(8));
        assert_eq!(reader.get::<String>(), Ok("x".to_owned()));
        assert_eq!(reader.position(), bytes.len());
        // The bytes first, then the value.
        let of = received(&body);
        assert_eq!(of.bytes(), bytes);
        let read = typed::read::<(u8, u32, String)>(&mut of.reader());
        assert_eq!(read, Ok((7, 8, "x".to_owned())));
        // It is there once.
        let of = received(&body);
        assert!(typed::read::<(u8, u32, String)>(&mut of.reader()).is_ok());
        assert!(typed::read::<(u8, u32, String)>(&mut of.reader()).is_err());
        assert!(of.bytes().is_empty());
    }

    #[test]
    fn a_reply_answers_another_request_too() {
        let reply = SharedValue::behind(Some([9; ENVELOPE_OF_VALUES]), (&1.5_f64,));
        let reply = reply.expect("a value");
        let other = HeldValue::again(reply.clone(), [7; IDENTITY]);
        assert_eq!(
            other.envelope()[..=IDENTITY],
            [&[7; IDENTITY][..], &[9]].concat()
        );
        assert_eq!(other.bytes()[..=IDENTITY], other.envelope()[..=IDENTITY]);
        assert_eq!(other.shared().map(|value| value.len()), Some(reply.len()));
        let mut reader = other.reader();
        assert!(reader.raw(ENVELOPE_OF_VALUES).is_ok());
        assert_eq!(typed::read(&mut reader), Ok((1.5_f64,)));
        assert!(other.shared().is_none(), "it is taken");
    }

    #[test]
    fn what_cannot_be_encoded_is_no_value() {
        #[derive(Clone, Debug, PartialEq)]
        struct Short(Vec<u8>);

        impl Cdr for Short {
            fn encode(&self, writer: &mut Writer<'_>) {
                writer.bound("Short", self.0.len(), 2);
                writer.put(&self.0);
            }

            fn decode(reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
                reader.get().map(Self)
            }
        }

        assert!(SharedValue::of((&Short(vec![1, 2]),)).is_ok());
        let long = SharedValue::of((&Short(vec![1, 2, 3]),));
        assert!(matches!(long, Err(EncodeError::TooLong { length: 3, .. })));
        assert!(matches!(
            SharedValue::of(("a\0b",)),
            Err(EncodeError::ZeroByte)
        ));
    }

    #[test]
    fn a_value_behind_an_envelope_is_aligned_with_it() {
        let envelope = [9; crate::rpc::ENVELOPE_OF_VALUES];
        let body = SharedValue::behind(Some(envelope), (&1.5_f64,)).expect("a value");
        assert_eq!((body.len(), body.bytes().len()), (48, 48));
        for take in [true, false] {
            let of = received(&body);
            let mut reader = of.reader();
            assert_eq!(reader.raw(36), Ok(&envelope[..]));
            if take {
                assert_eq!(typed::read(&mut reader), Ok((1.5_f64,)));
            } else {
                assert_eq!(reader.get(), Ok(1.5_f64));
            }
        }
        // Only where it begins.
        let of = received(&body);
        assert!(typed::read::<(f64,)>(&mut of.reader()).is_ok_and(|(read,)| read != 1.5));
    }
}
