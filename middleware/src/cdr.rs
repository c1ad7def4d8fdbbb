//! Serialization: OMG CDR, version XCDR1, little endian, as DDS and ROS 2 use it.
//!
//! Numbers are aligned to their size, counted from the start of the body. A sequence is its length
//! as uint32 and then its elements. A string is a sequence of bytes with a zero at its end. An enum
//! is an int32. An optional value is a sequence of none or one. Source: OMG DDS-XTypes 1.3, 7.4.1
//! (`PLAIN_CDR`).

use crate::header::Encoding;
use std::collections::BTreeMap;
use zerocopy::{FromBytes, FromZeros, IntoBytes};

/// A value cannot be encoded.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum EncodeError {
    /// A sequence or a string is longer than its type allows.
    #[error("`{what}` has {length} elements, its type allows {bound}")]
    TooLong {
        /// The name of the member.
        what: &'static str,
        /// Its length.
        length: usize,
        /// The bound of its type.
        bound: usize,
    },
    /// A number is outside the range of its annotation.
    #[error("`{what}` is {value}, outside its range {range}")]
    OutOfRange {
        /// The member.
        what: &'static str,
        /// Its value.
        value: f64,
        /// The range of its annotation.
        range: &'static str,
    },
    /// A string holds a zero byte, which CDR does not allow.
    #[error("a string holds a zero byte")]
    ZeroByte,
    /// An enum, a `bool` or a string in place holds no valid value.
    #[error("{0}")]
    NoValue(String),
    /// There is no memory for the value.
    #[error("there is no memory for {0} bytes")]
    NoMemory(usize),
    /// A closure that serializes a value twice has not written the same both times.
    #[error("the value changed while it was written")]
    Changed,
}

/// Bytes are no value of the expected type.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DecodeError {
    /// The bytes end too early.
    #[error("the message ends too early, at byte {0}")]
    Truncated(usize),
    /// A bool or an enum holds no valid value.
    #[error("{value} is not a value of `{what}`")]
    NoSuchValue {
        /// The name of the type.
        what: &'static str,
        /// The number that was found.
        value: i64,
    },
    /// A string is not UTF-8 or lacks its end.
    #[error("a string is not UTF-8 with a zero at its end")]
    BadString,
    /// Longer than its type allows.
    #[error("`{what}` has {length} elements, its type allows {bound}")]
    TooLong {
        /// The member.
        what: &'static str,
        /// The length found.
        length: usize,
        /// The bound of its type.
        bound: usize,
    },
    /// Outside the range of its annotation.
    #[error("`{what}` is {value}, outside its range {range}")]
    OutOfRange {
        /// The member.
        what: &'static str,
        /// The value found.
        value: f64,
        /// The range of its annotation.
        range: &'static str,
    },
    /// The interface does not have an operation or an exception.
    #[error("unknown {0}")]
    Unknown(&'static str),
    /// A memory image does not have the size of its type.
    #[error("{length} bytes are no `{what}` in place, which has {expected}")]
    NotAnImage {
        /// The type.
        what: &'static str,
        /// The number of bytes that arrived.
        length: usize,
        /// The size of the type.
        expected: usize,
    },
    /// A memory image arrived for an operation that has none on this side.
    #[error(
        "a memory image arrived for an operation that has none here; regenerate both components"
    )]
    Image,
    /// A value cannot be copied.
    #[error(transparent)]
    Invalid(#[from] EncodeError),
}

/// Arrays of numbers from this size on, in bytes, are written straight into the memory of the
/// middleware. A second pass over the value costs less than copying them once more.
const BULK: usize = 8 * 1024;

/// Serializes values, one after the other. Keeps the first error until [`Writer::finish`].
///
/// ```
/// use rc_middleware::Writer;
///
/// let mut writer = Writer::default();
/// writer.put(&1_u8);
/// writer.put(&2_u32); // aligned to 4 bytes
/// assert_eq!(writer.finish(), Ok(&[1, 0, 0, 0, 2, 0, 0, 0][..]));
/// ```
#[derive(Debug, Default)]
pub struct Writer<'m> {
    output: Output<'m>,
    /// Bytes of large arrays that were counted and not written.
    skipped: usize,
    error: Option<EncodeError>,
}

#[derive(Debug)]
enum Output<'m> {
    /// A buffer that grows. If `skips` is set, large arrays are only counted.
    Buffer { bytes: Vec<u8>, skips: bool },
    /// Memory of the size of the body, filled up to `at`.
    Memory { memory: &'m mut [u8], at: usize },
}

impl Default for Output<'_> {
    fn default() -> Self {
        Self::Buffer {
            bytes: Vec::new(),
            skips: false,
        }
    }
}

impl Writer<'static> {
    /// Appends to `bytes`.
    pub fn over(bytes: Vec<u8>) -> Self {
        Self {
            output: Output::Buffer {
                bytes,
                skips: false,
            },
            skipped: 0,
            error: None,
        }
    }

    /// Starts a new body in the same buffer.
    pub fn clear(&mut self) {
        self.restart(false);
    }

    /// Starts a new body in the same buffer, in which large arrays are only counted.
    pub(crate) fn measure(&mut self) {
        self.restart(true);
    }

    fn restart(&mut self, skip: bool) {
        if let Output::Buffer { bytes, skips } = &mut self.output {
            bytes.clear();
            *skips = skip;
        }
        self.skipped = 0;
        self.error = None;
    }

    /// Whether [`Writer::measure`] has left out large arrays, so that the body is not complete.
    pub(crate) fn has_skipped(&self) -> bool {
        self.skipped > 0
    }

    /// The bytes written so far, even after an error.
    pub fn into_bytes(self) -> Vec<u8> {
        match self.output {
            Output::Buffer { bytes, .. } => bytes,
            Output::Memory { memory, at } => memory[..at].to_vec(),
        }
    }
}

impl<'m> Writer<'m> {
    /// Writes into `memory`, which has the size of the body.
    pub(crate) fn into_memory(memory: &'m mut [u8]) -> Self {
        Self {
            output: Output::Memory { memory, at: 0 },
            skipped: 0,
            error: None,
        }
    }

    /// The body, or the first error.
    pub fn finish(&mut self) -> Result<&[u8], EncodeError> {
        match self.error.take() {
            Some(error) => Err(error),
            None => Ok(match &self.output {
                Output::Buffer { bytes, .. } => bytes,
                Output::Memory { memory, at } => &memory[..*at],
            }),
        }
    }

    /// Length of the body so far, in bytes.
    #[inline]
    pub fn len(&self) -> usize {
        match &self.output {
            Output::Buffer { bytes, .. } => bytes.len() + self.skipped,
            Output::Memory { at, .. } => *at,
        }
    }

    /// Whether the body is empty.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Keeps the first error.
    pub fn fail(&mut self, error: EncodeError) {
        self.error.get_or_insert(error);
    }

    /// Writes one value.
    #[inline]
    pub fn put<T: Cdr>(&mut self, value: &T) {
        value.encode(self);
    }

    /// Fails if `length` exceeds the bound of `what`.
    pub fn bound(&mut self, what: &'static str, length: usize, bound: usize) {
        if length > bound {
            self.fail(EncodeError::TooLong {
                what,
                length,
                bound,
            });
        }
    }

    /// Fails if `value` is outside `min..=max`; NaN is outside every range.
    pub fn range(
        &mut self,
        what: &'static str,
        value: f64,
        (min, max): (f64, f64),
        range: &'static str,
    ) {
        if !(min..=max).contains(&value) {
            self.fail(EncodeError::OutOfRange { what, value, range });
        }
    }

    /// Writes bytes without alignment.
    #[inline]
    pub fn raw(&mut self, bytes: &[u8]) {
        match &mut self.output {
            Output::Buffer { bytes: buffer, .. } => buffer.extend_from_slice(bytes),
            Output::Memory { memory, at } => {
                let end = *at + bytes.len();
                if let Some(place) = memory.get_mut(*at..end) {
                    place.copy_from_slice(bytes);
                    *at = end;
                } else {
                    // Nothing may follow in the rest of the memory.
                    *at = memory.len();
                    self.fail(EncodeError::Changed);
                }
            }
        }
    }

    /// Writes the bytes of an array of numbers without alignment.
    fn array(&mut self, bytes: &[u8]) {
        match &mut self.output {
            Output::Buffer { skips: true, .. } if bytes.len() >= BULK => {
                self.skipped += bytes.len();
            }
            _ => self.raw(bytes),
        }
    }

    /// Writes a length as uint32.
    pub fn length(&mut self, length: usize) {
        self.put(&u32::try_from(length).unwrap_or(u32::MAX));
    }

    /// Writes zeros up to the next multiple of `size` bytes; `size` is at most 8.
    #[inline]
    pub(crate) fn align(&mut self, size: usize) {
        let rest = self.len() % size;
        if rest != 0 {
            self.raw(&[0; 8][..size - rest]);
        }
    }
}

/// Reads values one after the other.
///
/// ```
/// use rc_middleware::Reader;
///
/// let mut reader = Reader::new(&[1, 0, 0, 0, 2, 0, 0, 0]);
/// assert_eq!(reader.get::<u8>(), Ok(1));
/// assert_eq!(reader.get::<u32>(), Ok(2)); // aligned to 4 bytes
/// assert!(reader.get::<u8>().is_err());
/// ```
#[derive(Clone, Debug)]
pub struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
    /// The rest is the memory image of a plain type.
    image: bool,
}

impl<'a> Reader<'a> {
    /// Reads a body from its start.
    pub fn new(bytes: &'a [u8]) -> Self {
        Self::of(bytes, Encoding::Cdr)
    }

    /// Reads a body in this encoding from its start.
    pub fn of(bytes: &'a [u8], encoding: Encoding) -> Self {
        Self {
            bytes,
            at: 0,
            image: encoding == Encoding::Image,
        }
    }

    /// Continues at byte `at` of the body, where the memory image of a plain type begins.
    pub(crate) fn image_at(&mut self, at: usize) {
        self.at = at.min(self.bytes.len());
        self.image = true;
    }

    /// Whether the rest is the memory image of a plain type.
    pub(crate) fn is_image(&self) -> bool {
        self.image
    }

    /// The memory image that follows.
    pub(crate) fn image(&mut self) -> Option<&'a [u8]> {
        if !self.image {
            return None;
        }
        let image = &self.bytes[self.at..];
        self.at = self.bytes.len();
        Some(image)
    }

    /// Reads one value.
    #[inline]
    pub fn get<T: Cdr>(&mut self) -> Result<T, DecodeError> {
        T::decode(self)
    }

    /// The bytes that were not read yet.
    pub fn rest(&self) -> &'a [u8] {
        self.bytes.get(self.at..).unwrap_or_default()
    }

    /// The next `count` bytes, not aligned.
    #[inline]
    pub fn raw(&mut self, count: usize) -> Result<&'a [u8], DecodeError> {
        if self.image {
            return Err(DecodeError::Image);
        }
        let end = self
            .at
            .checked_add(count)
            .ok_or(DecodeError::Truncated(self.at))?;
        let taken = self
            .bytes
            .get(self.at..end)
            .ok_or(DecodeError::Truncated(self.bytes.len()))?;
        self.at = end;
        Ok(taken)
    }

    /// Reads a length. It is at most the number of elements that the rest can hold, so a false
    /// length allocates no memory.
    pub fn length(&mut self) -> Result<usize, DecodeError> {
        let length = self.get::<u32>()? as usize;
        if length > self.bytes.len() - self.at {
            return Err(DecodeError::Truncated(self.bytes.len()));
        }
        Ok(length)
    }

    /// Reads a string, in the memory of the message.
    pub(crate) fn text(&mut self) -> Result<&'a str, DecodeError> {
        let length = self.length()?;
        let [inner @ .., 0] = self.raw(length)? else {
            return Err(DecodeError::BadString);
        };
        if inner.contains(&0) {
            return Err(DecodeError::BadString);
        }
        std::str::from_utf8(inner).map_err(|_| DecodeError::BadString)
    }

    /// Fails if `length` exceeds the bound of `what`.
    pub fn bound(
        &self,
        what: &'static str,
        length: usize,
        bound: usize,
    ) -> Result<(), DecodeError> {
        if length > bound {
            Err(DecodeError::TooLong {
                what,
                length,
                bound,
            })
        } else {
            Ok(())
        }
    }

    /// Fails if a value is outside `min..=max`; NaN is outside every range.
    pub fn range(
        &self,
        what: &'static str,
        value: f64,
        (min, max): (f64, f64),
        range: &'static str,
    ) -> Result<(), DecodeError> {
        if (min..=max).contains(&value) {
            Ok(())
        } else {
            Err(DecodeError::OutOfRange { what, value, range })
        }
    }

    /// Continues at the next multiple of `size` bytes.
    pub(crate) fn align(&mut self, size: usize) {
        self.at = self.at.next_multiple_of(size).min(self.bytes.len());
    }
}

/// A value that can be encoded and decoded.
pub trait Cdr: Sized {
    /// Writes the value.
    fn encode(&self, writer: &mut Writer<'_>);

    /// Reads a value.
    fn decode(reader: &mut Reader<'_>) -> Result<Self, DecodeError>;

    /// Writes several values without their number. Arrays of numbers are copied at once.
    fn encode_all(items: &[Self], writer: &mut Writer<'_>) {
        for item in items {
            item.encode(writer);
        }
    }

    /// Reads several values. Arrays of numbers are copied at once.
    fn decode_all(count: usize, reader: &mut Reader<'_>) -> Result<Vec<Self>, DecodeError> {
        (0..count).map(|_| Self::decode(reader)).collect()
    }
}

macro_rules! numbers {
    ($($number:ty),*) => {$(
        impl Cdr for $number {
            #[inline]
            fn encode(&self, writer: &mut Writer<'_>) {
                writer.align(size_of::<Self>());
                writer.raw(&self.to_le_bytes());
            }

            #[inline]
            fn decode(reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
                reader.align(size_of::<Self>());
                let mut bytes = [0; size_of::<Self>()];
                bytes.copy_from_slice(reader.raw(size_of::<Self>())?);
                Ok(Self::from_le_bytes(bytes))
            }

            #[cfg(target_endian = "little")]
            fn encode_all(items: &[Self], writer: &mut Writer<'_>) {
                if !items.is_empty() {
                    writer.align(size_of::<Self>());
                    writer.array(items.as_bytes());
                }
            }

            #[cfg(target_endian = "little")]
            fn decode_all(count: usize, reader: &mut Reader<'_>) -> Result<Vec<Self>, DecodeError> {
                if count == 0 {
                    return Ok(Vec::new());
                }
                reader.align(size_of::<Self>());
                let size = count.checked_mul(size_of::<Self>()).ok_or(DecodeError::Truncated(reader.at))?;
                let bytes = reader.raw(size)?;
                // Aligned numbers, which are the rule, are copied without filling the memory with
                // zeros first.
                if let Ok(items) = <[Self]>::ref_from_bytes(bytes) {
                    return Ok(items.to_vec());
                }
                let mut items: Vec<Self> =
                    Self::new_vec_zeroed(count).map_err(|_| EncodeError::NoMemory(size))?;
                items.as_mut_bytes().copy_from_slice(bytes);
                Ok(items)
            }
        }
    )*};
}

numbers!(i8, u8, i16, u16, i32, u32, i64, u64, f32, f64);

impl Cdr for bool {
    fn encode(&self, writer: &mut Writer<'_>) {
        writer.raw(&[u8::from(*self)]);
    }

    fn decode(reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
        match reader.raw(1)? {
            [0] => Ok(false),
            [1] => Ok(true),
            other => Err(DecodeError::NoSuchValue {
                what: "bool",
                value: other.first().copied().map_or(-1, i64::from),
            }),
        }
    }
}

impl Cdr for String {
    fn encode(&self, writer: &mut Writer<'_>) {
        text(self, writer);
    }

    fn decode(reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
        reader.text().map(str::to_owned)
    }
}

/// Writes a borrowed string.
pub fn text(value: &str, writer: &mut Writer<'_>) {
    if value.as_bytes().contains(&0) {
        writer.fail(EncodeError::ZeroByte);
    }
    writer.length(value.len() + 1);
    writer.raw(value.as_bytes());
    writer.raw(&[0]);
}

/// Writes a borrowed sequence.
pub fn sequence<T: Cdr>(items: &[T], writer: &mut Writer<'_>) {
    writer.length(items.len());
    T::encode_all(items, writer);
}

impl<T: Cdr> Cdr for Vec<T> {
    fn encode(&self, writer: &mut Writer<'_>) {
        sequence(self, writer);
    }

    fn decode(reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
        let count = reader.length()?;
        T::decode_all(count, reader)
    }
}

impl<T: Cdr, const N: usize> Cdr for [T; N] {
    fn encode(&self, writer: &mut Writer<'_>) {
        T::encode_all(self, writer);
    }

    fn decode(reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
        let at = reader.at;
        T::decode_all(N, reader)?
            .try_into()
            .map_err(|_| DecodeError::Truncated(at))
    }
}

impl<T: Cdr> Cdr for Option<T> {
    fn encode(&self, writer: &mut Writer<'_>) {
        writer.length(usize::from(self.is_some()));
        if let Some(value) = self {
            value.encode(writer);
        }
    }

    fn decode(reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
        let count = reader.length()?;
        reader.bound("an optional value", count, 1)?;
        if count == 0 {
            Ok(None)
        } else {
            T::decode(reader).map(Some)
        }
    }
}

impl<K: Cdr + Ord, V: Cdr> Cdr for BTreeMap<K, V> {
    fn encode(&self, writer: &mut Writer<'_>) {
        writer.length(self.len());
        for (key, value) in self {
            key.encode(writer);
            value.encode(writer);
        }
    }

    fn decode(reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
        let count = reader.length()?;
        (0..count)
            .map(|_| Ok((K::decode(reader)?, V::decode(reader)?)))
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bytes_of<T: Cdr>(value: &T) -> Vec<u8> {
        let mut writer = Writer::default();
        writer.put(value);
        writer.into_bytes()
    }

    #[test]
    fn bytes_are_those_of_the_specification() {
        let mut writer = Writer::default();
        writer.put(&1_u8);
        writer.put(&2_u32);
        writer.put(&"ab".to_owned());
        writer.put(&3.0_f64);
        let expected = [
            1, 0, 0, 0, 2, 0, 0, 0, 3, 0, 0, 0, b'a', b'b', 0, 0, 0, 0, 0, 0, 0, 0, 0x08, 0x40,
        ];
        assert_eq!(writer.into_bytes(), expected);
    }

    #[test]
    fn everything_comes_back() {
        let map: BTreeMap<String, Vec<f32>> =
            [("a".to_owned(), vec![1.0, 2.0]), ("b".to_owned(), vec![])].into();
        let bytes = bytes_of(&map);
        assert_eq!(
            Reader::new(&bytes).get::<BTreeMap<String, Vec<f32>>>(),
            Ok(map)
        );
        let value = Some([1_i16, -2, 3]);
        assert_eq!(
            Reader::new(&bytes_of(&value)).get::<Option<[i16; 3]>>(),
            Ok(value)
        );
    }

    #[test]
    fn numbers_are_read_wherever_they_lie() {
        let items: Vec<f64> = (0..5).map(f64::from).collect();
        let mut room = [0_u64; 8];
        let bytes = bytes_of(&items);
        for shift in 0..8 {
            let place = &mut room.as_mut_bytes()[shift..shift + bytes.len()];
            place.copy_from_slice(&bytes);
            assert_eq!(Reader::new(place).get::<Vec<f64>>().as_ref(), Ok(&items));
        }
    }

    #[test]
    fn hostile_bytes_are_errors_and_ask_for_no_memory() {
        let huge = u32::MAX.to_le_bytes();
        assert!(Reader::new(&huge).get::<Vec<u64>>().is_err());
        assert!(Reader::new(&huge).get::<String>().is_err());
        assert!(Reader::new(&[2]).get::<bool>().is_err());
        for end in 0..8 {
            assert!(
                Reader::new(&bytes_of(&vec![1_u32])[..end])
                    .get::<Vec<u32>>()
                    .is_err()
            );
        }
    }
}
