//! Parameters and replies of operations as tuples of Rust: one part after the other on the wire.

use crate::cdr::{Cdr, DecodeError, Reader, Writer};
use crate::error::CallError;
use crate::typed::{HandlerError, Request};

/// Borrowed parameters of an operation: references, `&str`, slices, and tuples of them.
///
/// ```
/// use rc_middleware::Writer;
/// use rc_middleware::typed::Put;
///
/// let mut writer = Writer::default();
/// ("front", &[1_u8, 2][..], &7_i32).put(&mut writer);
/// assert_eq!(writer.into_bytes().len(), 24);
/// ```
pub trait Put: Copy {
    /// These parts as a value, which a receiver in the same process takes.
    type Owned: Returned;

    /// Writes the parts in their order.
    fn put(self, writer: &mut Writer<'_>);

    /// Copies the parts.
    fn own(self) -> Self::Owned;
}

impl<T: Cdr> Put for &T {
    type Owned = T;

    fn put(self, writer: &mut Writer<'_>) {
        writer.put(self);
    }

    fn own(self) -> T {
        self.clone()
    }
}

impl Put for &str {
    type Owned = String;

    fn put(self, writer: &mut Writer<'_>) {
        crate::cdr::text(self, writer);
    }

    fn own(self) -> String {
        self.to_owned()
    }
}

impl<T: Cdr> Put for &[T] {
    type Owned = Vec<T>;

    fn put(self, writer: &mut Writer<'_>) {
        crate::cdr::sequence(self, writer);
    }

    fn own(self) -> Vec<T> {
        self.to_vec()
    }
}

/// No parameters: CDR has no empty structure.
impl Put for () {
    type Owned = ();

    fn put(self, writer: &mut Writer<'_>) {
        writer.put(&0_u8);
    }

    fn own(self) {}
}

/// Parameters that `write` writes, with checks of their bounds and ranges. A receiver in this
/// process takes the parts, and checks them with its own ranges, which may differ.
///
/// ```
/// use rc_middleware::Writer;
/// use rc_middleware::typed::{Checked, Put};
///
/// let gains = [1_u8, 2, 3];
/// let checked = Checked::new((&gains[..],), |writer| {
///     writer.bound("Arm.set.gains", gains.len(), 2);
///     gains[..].put(writer);
/// });
/// let mut writer = Writer::default();
/// checked.put(&mut writer);
/// assert!(writer.finish().is_err());
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Checked<P, W> {
    parts: P,
    write: W,
}

impl<P: Put, W: Fn(&mut Writer<'_>) + Copy> Checked<P, W> {
    /// `write` writes `parts`.
    pub fn new(parts: P, write: W) -> Self {
        Self { parts, write }
    }
}

impl<P: Put, W: Fn(&mut Writer<'_>) + Copy> Put for Checked<P, W> {
    type Owned = P::Owned;

    fn put(self, writer: &mut Writer<'_>) {
        (self.write)(writer);
    }

    fn own(self) -> P::Owned {
        self.parts.own()
    }
}

/// The parameters of an operation as its handler gets them: a tuple.
pub trait Arguments: Sized {
    /// Reads the parts in their order.
    fn read(reader: &mut Reader<'_>) -> Result<Self, DecodeError>;
}

impl Arguments for () {
    fn read(reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
        match reader.value_itself() {
            Some(()) => Ok(()),
            None => reader.get::<u8>().map(drop),
        }
    }
}

/// The result of an operation: nothing, a value, or a tuple of several.
pub trait Returned: Clone + Send + Sync + 'static {
    /// Writes the parts in their order.
    fn write(&self, writer: &mut Writer<'_>);

    /// Reads the parts in their order.
    fn read(reader: &mut Reader<'_>) -> Result<Self, DecodeError>;
}

/// The byte of an empty structure says nothing, and a reply of an operation that throws may lack
/// it.
impl Returned for () {
    fn write(&self, writer: &mut Writer<'_>) {
        writer.put(&0_u8);
    }

    fn read(_: &mut Reader<'_>) -> Result<Self, DecodeError> {
        Ok(())
    }
}

impl<T: Cdr> Returned for T {
    fn write(&self, writer: &mut Writer<'_>) {
        writer.put(self);
    }

    fn read(reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
        match reader.value_itself() {
            Some(value) => Ok(value),
            None => reader.get(),
        }
    }
}

macro_rules! tuples {
    ($(($($part:ident $at:tt),+))*) => {$(
        impl<$($part: Put),+> Put for ($($part,)+) {
            type Owned = ($($part::Owned,)+);

            fn put(self, writer: &mut Writer<'_>) {
                $(self.$at.put(writer);)+
            }

            fn own(self) -> Self::Owned {
                ($(self.$at.own(),)+)
            }
        }

        impl<$($part: Cdr),+> Arguments for ($($part,)+) {
            fn read(reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
                if let Some(value) = reader.value_itself() {
                    return Ok(value);
                }
                Ok(($(reader.get::<$part>()?,)+))
            }
        }

        impl<$($part: Returned),+> Returned for ($($part,)+) {
            fn write(&self, writer: &mut Writer<'_>) {
                $(self.$at.write(writer);)+
            }

            fn read(reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
                if let Some(value) = reader.value_itself() {
                    return Ok(value);
                }
                Ok(($($part::read(reader)?,)+))
            }
        }
    )*};
}

/// The most parts of a tuple with these traits, as in the standard library. A part may be a tuple.
pub const MOST_PARTS: usize = 12;

tuples! {
    (A 0)
    (A 0, B 1)
    (A 0, B 1, C 2)
    (A 0, B 1, C 2, D 3)
    (A 0, B 1, C 2, D 3, E 4)
    (A 0, B 1, C 2, D 3, E 4, F 5)
    (A 0, B 1, C 2, D 3, E 4, F 5, G 6)
    (A 0, B 1, C 2, D 3, E 4, F 5, G 6, H 7)
    (A 0, B 1, C 2, D 3, E 4, F 5, G 6, H 7, I 8)
    (A 0, B 1, C 2, D 3, E 4, F 5, G 6, H 7, I 8, J 9)
    (A 0, B 1, C 2, D 3, E 4, F 5, G 6, H 7, I 8, J 9, K 10)
    (A 0, B 1, C 2, D 3, E 4, F 5, G 6, H 7, I 8, J 9, K 10, L 11)
}

/// Reads parameters: the usual function for [`Request::answer`].
pub fn read<A: Arguments>(reader: &mut Reader<'_>) -> Result<A, DecodeError> {
    A::read(reader)
}

/// Writes a result: the usual function for [`Request::answer`].
pub fn reply<R: Returned>(result: &R, writer: &mut Writer<'_>) {
    result.write(writer);
}

/// Reads a result: the usual function for [`TypedClient::query`](super::TypedClient::query).
pub fn result<R: Returned>(reader: &mut Reader<'_>) -> Result<R, DecodeError> {
    R::read(reader)
}

/// The error of an operation: one of the exceptions that it throws, or [`CallError`]. Generated
/// code has one for each set of exceptions.
pub trait Throws: From<CallError> {
    /// Reads the exception with the hash `case`, which is not 0.
    fn read(case: i32, reader: &mut Reader<'_>) -> Result<Self, DecodeError>;

    /// Replies with the error.
    fn refuse(self, request: &mut Request<'_>) -> Result<(), HandlerError>;
}

/// The error of an operation that throws nothing.
impl Throws for CallError {
    fn read(_: i32, _: &mut Reader<'_>) -> Result<Self, DecodeError> {
        Err(DecodeError::Unknown("exception in the reply"))
    }

    fn refuse(self, request: &mut Request<'_>) -> Result<(), HandlerError> {
        request.fail(&self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_read_in_the_order_in_which_they_were_written() {
        let mut writer = Writer::default();
        ("front", &[1_u8, 2][..], &7_i32).put(&mut writer);
        let bytes = writer.into_bytes();
        let read: Result<(String, Vec<u8>, i32), _> = read(&mut Reader::new(&bytes));
        assert_eq!(read, Ok(("front".to_owned(), vec![1, 2], 7)));
        let mut writer = Writer::default();
        (1_u8, "x".to_owned()).write(&mut writer);
        let bytes = writer.into_bytes();
        assert_eq!(result(&mut Reader::new(&bytes)), Ok((1_u8, "x".to_owned())));
    }

    #[test]
    fn no_parameters_are_one_byte() {
        let mut writer = Writer::default();
        ().put(&mut writer);
        assert_eq!(writer.into_bytes(), [0]);
        assert_eq!(read::<()>(&mut Reader::new(&[0])), Ok(()));
        assert!(read::<()>(&mut Reader::new(&[])).is_err());
    }
}
