//! Reads a body of CDR. Any bytes may arrive: a false length allocates no memory, and values take
//! memory in proportion to the bytes.

use super::{Cdr, DecodeError};
use crate::header::Encoding;
use crate::shared_value::HeldValue;

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
    /// Only the envelope of a value.
    bytes: &'a [u8],
    /// A value whose bytes were not needed so far.
    value: Option<&'a HeldValue>,
    pub(super) at: usize,
    /// The rest is the memory image of a plain type.
    image: bool,
    /// How many more bytes of memory the values may take.
    memory: usize,
}

/// How many times its own length a message may take in memory as values, besides [`ALLOWANCE`]. An
/// empty sequence takes six times as much.
const FACTOR: usize = 4;
/// How many bytes every message may take.
const ALLOWANCE: usize = 16 << 20;

fn budget(length: usize) -> usize {
    length.saturating_mul(FACTOR).saturating_add(ALLOWANCE)
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
            value: None,
            at: 0,
            image: encoding == Encoding::Image,
            memory: budget(bytes.len()),
        }
    }

    /// Reads a value, or its bytes, from the start.
    pub(crate) fn of_value(value: &'a HeldValue) -> Self {
        Self {
            value: Some(value),
            memory: budget(value.len()),
            ..Self::new(value.envelope())
        }
    }

    /// The value that follows, if a sender in this process has sent a `T`.
    pub fn value_itself<T: Clone + Send + Sync + 'static>(&mut self) -> Option<T> {
        let begins = self.at == self.bytes.len();
        let value = self.value.filter(|_| begins)?.take()?;
        self.value = None;
        Some(value)
    }

    /// Reads the bytes of a value from now on.
    #[cold]
    fn encode(&mut self) -> bool {
        let value = self.value.take();
        if let Some(value) = value {
            self.bytes = value.bytes();
        }
        value.is_some()
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

    /// The memory image that follows, where the sender wrote one.
    pub fn image(&mut self) -> Option<&'a [u8]> {
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

    /// The number of bytes that were read, or skipped.
    pub fn position(&self) -> usize {
        self.at
    }

    /// The bytes that were not read yet.
    pub fn rest(&self) -> &'a [u8] {
        let bytes = self.value.map_or(self.bytes, HeldValue::bytes);
        bytes.get(self.at..).unwrap_or_default()
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
        let Some(taken) = self.bytes.get(self.at..end) else {
            if self.encode() {
                return self.raw(count);
            }
            return Err(DecodeError::Truncated(self.bytes.len()));
        };
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

    /// Accounts for `count` values of `size` bytes each, before they are allocated.
    pub(crate) fn charge(&mut self, count: usize, size: usize) -> Result<(), DecodeError> {
        let left = count
            .checked_mul(size)
            .and_then(|bytes| self.memory.checked_sub(bytes));
        self.memory = left.ok_or(DecodeError::Inflated(self.bytes.len()))?;
        Ok(())
    }

    /// Reads a string, in the memory of the message.
    pub fn text(&mut self) -> Result<&'a str, DecodeError> {
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

    /// Fails if an integer is outside `min..=max`. 64 bits have more digits than an `f64`.
    pub fn integer_range(
        &self,
        what: &'static str,
        value: i128,
        (min, max): (i128, i128),
        range: &'static str,
    ) -> Result<(), DecodeError> {
        if (min..=max).contains(&value) {
            Ok(())
        } else {
            Err(DecodeError::IntegerOutOfRange { what, value, range })
        }
    }

    /// Continues at the next multiple of `size` bytes.
    pub(crate) fn align(&mut self, size: usize) {
        let at = self.at.next_multiple_of(size);
        if at > self.bytes.len() {
            self.encode();
        }
        self.at = at.min(self.bytes.len());
    }
}
