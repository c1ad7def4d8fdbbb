//! Values that are written and read where they are: the memory image of a plain type.
//!
//! A type is plain when its size is known from its declaration alone. For each one that travels in place generated
//! code has a structure in C's layout that holds only integers, floating-point numbers and lengths, with every gap
//! spelled out, so that *every* pattern of bytes is one of its values (`zerocopy` proves it when it compiles).
//! What an enum, a `bool` or a text makes of them is asked at each read, and lengths are never believed beyond
//! their bound. A reference exists only after size, alignment and the hash of the types were checked.
//!
//! Whoever sends in place is trusted not to write after sending: it is a process of the same user.

use crate::cdr::{Cdr, DecodeError, EncodeError, Reader};
use crate::counter::Counter;
use std::ops::{Deref, DerefMut};
pub use zerocopy::{self, FromBytes, FromZeros, Immutable, IntoBytes, KnownLayout};

/// Where the image begins in an answer: behind the envelope, which has 36 bytes, at the next multiple of 16.
pub const BEHIND_ENVELOPE: usize = 48;

/// The structure of a plain type. Its unused tails are neither written nor read.
pub trait InPlace: FromBytes + IntoBytes + KnownLayout + Immutable + 'static {
    /// The same type with its values in memory of their own.
    type Value: Cdr;

    /// The name of the type in messages.
    const NAME: &'static str;

    /// Gives all members their defaults; sequences and optional members are empty. What is behind a length stays what it
    /// was.
    fn reset(&mut self);

    /// Takes a value over.
    fn set(&mut self, value: &Self::Value) -> Result<(), EncodeError>;

    /// The value, copied. Fails where an enum, a `bool` or a text holds none of its values.
    fn value(&self) -> Result<Self::Value, DecodeError>;

    /// Whether the numbers are in the ranges of their annotations, also those of structures in sequences.
    fn check(&self) -> Result<(), DecodeError> {
        Ok(())
    }
}

/// A value that came: in the sender's memory, or in our own where it had to be copied.
#[derive(Debug)]
pub enum Placed<'a, T> {
    /// Where the sender wrote it.
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

/// A value in memory of our own, with its defaults; it is never on the stack.
pub fn boxed<T: InPlace>() -> Result<Box<T>, EncodeError> {
    let mut value = T::new_box_zeroed().map_err(|_| EncodeError::NoMemory(size_of::<T>()))?;
    value.reset();
    Ok(value)
}

/// The image in memory that was lent, with its defaults.
pub(crate) fn over<T: InPlace>(memory: &mut [u8]) -> Option<&mut T> {
    T::mut_from_bytes(memory).ok()
}

impl<'a> Reader<'a> {
    /// The value that follows, in place if that is how it was sent.
    pub fn in_place<T: InPlace>(&mut self) -> Result<Placed<'a, T>, DecodeError> {
        let Some(bytes) = self.image() else {
            let mut value = boxed::<T>()?;
            value.set(&self.get()?)?;
            return Ok(Placed::Copied(value));
        };
        let wrong = || DecodeError::NotAnImage {
            what: T::NAME,
            length: bytes.len(),
            expected: size_of::<T>(),
        };
        let value = match T::ref_from_bytes(bytes) {
            Ok(value) => Placed::Shared(value),
            // Of the right size, at a place where it cannot be read: a copy can.
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

    /// The value that follows, copied, however it was sent.
    pub fn value<T: InPlace>(&mut self) -> Result<T::Value, DecodeError> {
        if self.is_image() {
            self.in_place::<T>()?.value()
        } else {
            self.get()
        }
    }
}

/// A sequence or a text in place: how many of `items` there are. What is above the bound counts as the bound.
#[inline]
pub fn filled<T>(items: &[T], length: u32) -> &[T] {
    &items[..items.len().min(length as usize)]
}

/// The same, to be written.
#[inline]
pub fn filled_mut<T>(items: &mut [T], length: u32) -> &mut [T] {
    let length = items.len().min(length as usize);
    &mut items[..length]
}

/// Sets how many of `items` there are; fails where there are not so many.
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

/// The text in `bytes`.
pub fn text(bytes: &[u8]) -> Result<&str, DecodeError> {
    match std::str::from_utf8(bytes) {
        Ok(text) if !text.contains('\0') => Ok(text),
        _ => Err(DecodeError::BadString),
    }
}

/// Writes a text into `bytes`.
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

/// Takes one value over for each item; there are as many of both.
pub fn set_all<T: InPlace>(items: &mut [T], values: &[T::Value]) -> Result<(), EncodeError> {
    items
        .iter_mut()
        .zip(values)
        .try_for_each(|(item, value)| item.set(value))
}

/// The value of each item.
pub fn values<T: InPlace>(items: &[T]) -> Result<Vec<T::Value>, DecodeError> {
    items.iter().map(InPlace::value).collect()
}

/// The value of the first item, where there is one.
pub fn first<T: InPlace>(items: &[T]) -> Result<Option<T::Value>, DecodeError> {
    items.first().map(InPlace::value).transpose()
}

/// A `bool` in place: a byte, until somebody asks.
#[derive(Clone, Copy, Debug, FromBytes, Immutable, IntoBytes, KnownLayout)]
#[repr(transparent)]
pub struct Bool(u8);

impl Bool {
    /// The value. Fails where the byte is neither 0 nor 1.
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
        // There are N of them.
        values(self)?
            .try_into()
            .map_err(|_| DecodeError::Truncated(N))
    }
}

/// A value that is written in place and then sent. Dropped without being sent it is not sent.
pub struct Loan<'a, T: InPlace> {
    pub(crate) memory: Memory<'a, T>,
    pub(crate) send: Sending<'a>,
}

pub(crate) enum Memory<'a, T> {
    Shared(Box<dyn crate::backend::LoanedSample + 'a>),
    Copied(Box<T>, &'a mut dyn crate::backend::Publisher),
}

/// What is needed when it is sent.
pub(crate) struct Sending<'a> {
    pub(crate) type_hash: u64,
    pub(crate) sent: &'a Counter,
    pub(crate) writer: &'a mut crate::cdr::Writer<'static>,
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
