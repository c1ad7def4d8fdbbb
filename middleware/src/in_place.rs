//! Values that are written and read in shared memory: the memory image of a plain type.
//!
//! A type is plain if its declaration alone determines its size. For each type that travels in
//! place, generated code has a structure in the layout of C. The structure holds only integers,
//! floating-point numbers and lengths, and declares its padding, so that *every* pattern of bytes
//! is a value of it (`zerocopy` proves this at compile time). Enums, `bool`s and strings are
//! checked at each read, and a length above its bound counts as the bound. A reference exists only
//! after size, alignment and the hash of the types were checked.
//!
//! A sender in place is trusted not to write after sending: it is a process of the same user.

use crate::cdr::{Cdr, DecodeError, EncodeError, Reader};
use crate::counter::Counter;
use std::ops::{Deref, DerefMut};
pub use zerocopy::{self, FromBytes, FromZeros, Immutable, IntoBytes, KnownLayout};

/// Offset of the image in a reply: the next multiple of 16 after the envelope, which has 36 bytes.
pub const BEHIND_ENVELOPE: usize = 48;

/// The structure of a plain type. Unused elements of sequences are neither written nor read.
pub trait InPlace: FromBytes + IntoBytes + KnownLayout + Immutable + 'static {
    /// The corresponding type that owns its values.
    type Value: Cdr;

    /// The name of the type in messages.
    const NAME: &'static str;

    /// Sets all members to their defaults; sequences and optional members become empty. Unused
    /// elements keep their bytes.
    fn reset(&mut self);

    /// Copies a value into this structure.
    fn set(&mut self, value: &Self::Value) -> Result<(), EncodeError>;

    /// Copies the value out. It fails if an enum, a `bool` or a string holds no valid value.
    fn value(&self) -> Result<Self::Value, DecodeError>;

    /// Fails if a number is outside the range of its annotation, also in structures in sequences.
    fn check(&self) -> Result<(), DecodeError> {
        Ok(())
    }
}

/// A received value: in the memory of the sender, or a copy.
#[derive(Debug)]
pub enum Placed<'a, T> {
    /// In the memory of the sender.
    Shared(&'a T),
    /// A copy.
    Copied(Box<T>),
}

impl<T> Deref for Placed<'_, T> {
    type Target = T;

    fn deref(&self) -> &T {
        match self {
            Self::Shared(value) => value,
            Self::Copied(value) => value,
        }
    }
}

/// A new value with its defaults. It is never on the stack.
pub fn boxed<T: InPlace>() -> Result<Box<T>, EncodeError> {
    let mut value = T::new_box_zeroed().map_err(|_| EncodeError::NoMemory(size_of::<T>()))?;
    value.reset();
    Ok(value)
}

/// The image in lent memory, with its defaults.
pub(crate) fn over<T: InPlace>(memory: &mut [u8]) -> Option<&mut T> {
    T::mut_from_bytes(memory).ok()
}

impl<'a> Reader<'a> {
    /// Reads the next value, in place if it was sent so.
    pub fn in_place<T: InPlace>(&mut self) -> Result<Placed<'a, T>, DecodeError> {
        let Some(bytes) = self.image() else {
            let mut value = boxed::<T>()?;
            value.set(&self.only()?)?;
            return Ok(Placed::Copied(value));
        };
        let wrong = || DecodeError::NotAnImage {
            what: T::NAME,
            length: bytes.len(),
            expected: size_of::<T>(),
        };
        let value = match T::ref_from_bytes(bytes) {
            Ok(value) => Placed::Shared(value),
            // The image has the right size but not the alignment: copy it.
            Err(zerocopy::ConvertError::Alignment(_)) if bytes.len() == size_of::<T>() => {
                let mut value = boxed::<T>()?;
                value.as_mut_bytes().copy_from_slice(bytes);
                Placed::Copied(value)
            }
            Err(_) => return Err(wrong()),
        };
        value.check()?;
        Ok(value)
    }

    /// Reads the next value and copies it, in either encoding.
    pub fn value<T: InPlace>(&mut self) -> Result<T::Value, DecodeError> {
        if self.is_image() {
            self.in_place::<T>()?.value()
        } else {
            self.only()
        }
    }

    /// The only parameter or the result, as a value or decoded.
    fn only<V: Cdr>(&mut self) -> Result<V, DecodeError> {
        if let Some((value,)) = self.value_itself() {
            return Ok(value);
        }
        crate::typed::result(self)
    }
}

/// The used part of `items`, which hold a sequence or a string. A length above the bound counts as
/// the bound.
#[inline]
pub fn filled<T>(items: &[T], length: u32) -> &[T] {
    &items[..items.len().min(length as usize)]
}

/// The filled part of `items`, for writing.
#[inline]
pub fn filled_mut<T>(items: &mut [T], length: u32) -> &mut [T] {
    let length = items.len().min(length as usize);
    &mut items[..length]
}

/// Sets the number of used `items`; fails if it exceeds their number.
pub fn resize<'a, T>(
    what: &'static str,
    items: &'a mut [T],
    length: &mut u32,
    wanted: usize,
) -> Result<&'a mut [T], EncodeError> {
    let bound = items.len();
    let too_long = EncodeError::TooLong {
        what,
        length: wanted,
        bound,
    };
    let (Some(items), Ok(new)) = (items.get_mut(..wanted), u32::try_from(wanted)) else {
        return Err(too_long);
    };
    *length = new;
    Ok(items)
}

/// The string in `bytes`.
pub fn text(bytes: &[u8]) -> Result<&str, DecodeError> {
    match std::str::from_utf8(bytes) {
        Ok(text) if !text.contains('\0') => Ok(text),
        _ => Err(DecodeError::BadString),
    }
}

/// Writes a string into `bytes`.
pub fn set_text(
    what: &'static str,
    bytes: &mut [u8],
    length: &mut u32,
    text: &str,
) -> Result<(), EncodeError> {
    if text.contains('\0') {
        return Err(EncodeError::ZeroByte);
    }
    resize(what, bytes, length, text.len())?.copy_from_slice(text.as_bytes());
    Ok(())
}

/// Copies a value into each item; there are as many of both.
pub fn set_all<T: InPlace>(items: &mut [T], values: &[T::Value]) -> Result<(), EncodeError> {
    items
        .iter_mut()
        .zip(values)
        .try_for_each(|(item, value)| item.set(value))
}

/// Copies the value of each item out.
pub fn values<T: InPlace>(items: &[T]) -> Result<Vec<T::Value>, DecodeError> {
    items.iter().map(InPlace::value).collect()
}

/// Copies the value of the first item out, if there is one.
pub fn first<T: InPlace>(items: &[T]) -> Result<Option<T::Value>, DecodeError> {
    items.first().map(InPlace::value).transpose()
}

/// A `bool` in place: a byte, which is checked when it is read.
#[derive(Clone, Copy, Debug, FromBytes, Immutable, IntoBytes, KnownLayout)]
#[repr(transparent)]
pub struct Bool(u8);

impl Bool {
    /// The value. It fails if the byte is neither 0 nor 1.
    pub fn get(&self) -> Result<bool, DecodeError> {
        Reader::new(&[self.0]).get()
    }

    /// Sets the value.
    pub fn put(&mut self, value: bool) {
        self.0 = u8::from(value);
    }
}

impl InPlace for Bool {
    type Value = bool;

    const NAME: &'static str = "bool";

    fn reset(&mut self) {
        self.put(false);
    }

    fn set(&mut self, value: &bool) -> Result<(), EncodeError> {
        self.put(*value);
        Ok(())
    }

    fn value(&self) -> Result<bool, DecodeError> {
        self.get()
    }
}

macro_rules! numbers {
    ($($number:ty),*) => {$(
        impl InPlace for $number {
            type Value = Self;

            const NAME: &'static str = stringify!($number);

            fn reset(&mut self) {
                *self = Self::default();
            }

            fn set(&mut self, value: &Self) -> Result<(), EncodeError> {
                *self = *value;
                Ok(())
            }

            fn value(&self) -> Result<Self, DecodeError> {
                Ok(*self)
            }
        }
    )*};
}

numbers!(i8, u8, i16, u16, i32, u32, i64, u64, f32, f64);

impl<T: InPlace, const N: usize> InPlace for [T; N] {
    type Value = [T::Value; N];

    const NAME: &'static str = "array";

    fn reset(&mut self) {
        self.iter_mut().for_each(InPlace::reset);
    }

    fn check(&self) -> Result<(), DecodeError> {
        self.iter().try_for_each(InPlace::check)
    }

    fn set(&mut self, value: &Self::Value) -> Result<(), EncodeError> {
        set_all(self, value)
    }

    fn value(&self) -> Result<Self::Value, DecodeError> {
        // The iterator has N items.
        values(self)?
            .try_into()
            .map_err(|_| DecodeError::Truncated(N))
    }
}

/// A value that is written in place and then sent. Dropping it without sending discards it.
pub struct Loan<'a, T: InPlace> {
    pub(crate) memory: Memory<'a, T>,
    pub(crate) send: Sending<'a>,
}

pub(crate) enum Memory<'a, T> {
    Shared(Box<dyn crate::backend::LoanedSample + 'a>),
    Copied(Box<T>, &'a mut dyn crate::backend::Publisher),
}

/// Parts that are needed to send a loan.
pub(crate) struct Sending<'a> {
    pub(crate) type_hash: u64,
    pub(crate) sent: &'a Counter,
    pub(crate) writer: &'a mut crate::cdr::Writer<'static>,
    /// The counter of a publisher that is to be silent.
    pub(crate) withheld: Option<&'a Counter>,
}

impl<T: InPlace> Deref for Loan<'_, T> {
    type Target = T;

    fn deref(&self) -> &T {
        match &self.memory {
            Memory::Copied(value, _) => value,
            Memory::Shared(loan) => match T::ref_from_bytes(loan.memory()) {
                Ok(value) => value,
                Err(_) => unreachable!("size and alignment were checked when it was lent"),
            },
        }
    }
}

impl<T: InPlace> DerefMut for Loan<'_, T> {
    fn deref_mut(&mut self) -> &mut T {
        match &mut self.memory {
            Memory::Copied(value, _) => value,
            Memory::Shared(loan) => match over(loan.memory_mut()) {
                Some(value) => value,
                None => unreachable!("size and alignment were checked when it was lent"),
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_is_utf_8_without_a_zero_byte() {
        assert_eq!(text("grün".as_bytes()), Ok("grün"));
        assert_eq!(text(b""), Ok(""));
        assert_eq!(text(b"a\0b"), Err(DecodeError::BadString));
        assert_eq!(text(&[0xff]), Err(DecodeError::BadString));
    }
}
