//! Many numbers of one type, which take no more memory than on the wire.

use rc_middleware::{Cdr, DecodeError, Reader, Writer};
use rc_vocabulary::Primitive;

/// An element of [`Numbers`], or a single number: a number of any of the types.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Element {
    Bool(bool),
    /// Of another type than `uint64`.
    Int(i64),
    Uint(u64),
    F32(f32),
    F64(f64),
}

macro_rules! numbers {
    ($($kind:ident $number:ty: $value:expr, $from:expr;)*) => {
        /// A sequence or an array of numbers.
        #[derive(Clone, Debug, PartialEq)]
        #[allow(missing_docs, reason = "the names say it")]
        pub enum Numbers {
            $($kind(Vec<$number>),)*
        }

        impl Element {
            /// Reads a number of this type.
            pub(crate) fn read(of: Primitive, reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
                Ok(match of {
                    $(Primitive::$kind => $value(reader.get::<$number>()?),)*
                })
            }
        }

        impl Numbers {
            /// No numbers of this type.
            pub fn empty(of: Primitive) -> Self {
                match of {
                    $(Primitive::$kind => Self::$kind(Vec::new()),)*
                }
            }

            /// This many defaults of this type.
            pub(crate) fn zeros(of: Primitive, count: usize) -> Self {
                match of {
                    $(Primitive::$kind => Self::$kind(vec![<$number>::default(); count]),)*
                }
            }

            /// The type of the numbers.
            pub fn primitive(&self) -> Primitive {
                match self {
                    $(Self::$kind(_) => Primitive::$kind,)*
                }
            }

            /// The number of elements.
            pub fn len(&self) -> usize {
                match self {
                    $(Self::$kind(items) => items.len(),)*
                }
            }

            /// Whether it is empty.
            pub fn is_empty(&self) -> bool {
                self.len() == 0
            }

            pub(crate) fn element(&self, at: usize) -> Option<Element> {
                match self {
                    $(Self::$kind(items) => items.get(at).copied().map($value),)*
                }
            }

            /// Appends a number of the same type. Returns whether it was one.
            pub(crate) fn push_element(&mut self, element: Element) -> bool {
                match self {
                    $(Self::$kind(items) => {
                        let number: Option<$number> = $from(element);
                        items.extend(number);
                        number.is_some()
                    })*
                }
            }

            /// Reads numbers without their count.
            pub(crate) fn decode(
                of: Primitive,
                count: usize,
                reader: &mut Reader<'_>,
            ) -> Result<Self, DecodeError> {
                Ok(match of {
                    $(Primitive::$kind => Self::$kind(<$number>::decode_all(count, reader)?),)*
                })
            }

            /// Writes the numbers without their count.
            pub(crate) fn encode(&self, writer: &mut Writer<'_>) {
                match self {
                    $(Self::$kind(items) => <$number>::encode_all(items, writer),)*
                }
            }
        }
    };
}

fn whole(number: impl Into<i64>) -> Element {
    Element::Int(number.into())
}

fn int<T: TryFrom<i64>>(number: Element) -> Option<T> {
    match number {
        Element::Int(number) => T::try_from(number).ok(),
        _ => None,
    }
}

numbers! {
    Bool bool: Element::Bool, |number| match number { Element::Bool(number) => Some(number), _ => None };
    I8 i8: whole, int;
    U8 u8: whole, int;
    I16 i16: whole, int;
    U16 u16: whole, int;
    I32 i32: whole, int;
    U32 u32: whole, int;
    I64 i64: Element::Int, int;
    U64 u64: Element::Uint, |number| match number { Element::Uint(number) => Some(number), _ => None };
    F32 f32: Element::F32, |number| match number { Element::F32(number) => Some(number), _ => None };
    F64 f64: Element::F64, |number| match number { Element::F64(number) => Some(number), _ => None };
}
