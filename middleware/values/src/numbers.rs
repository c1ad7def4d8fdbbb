//! Many numbers of one type, which take no more memory than on the wire.

use crate::types::Primitive;
use crate::value::Value;
use rc_middleware::{Cdr, DecodeError, Reader, Writer};

macro_rules! numbers {
    ($($kind:ident $number:ty: $value:expr, $from:expr;)*) => {
        /// A sequence or an array of numbers.
        #[derive(Clone, Debug, PartialEq)]
        #[allow(missing_docs, reason = "the names say it")]
        pub enum Numbers {
            $($kind(Vec<$number>),)*
        }

        impl Numbers {
            /// No numbers of this type.
            pub fn empty(of: Primitive) -> Self {
                match of {
                    $(Primitive::$kind => Self::$kind(Vec::new()),)*
                }
            }

            /// So many defaults of this type.
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

            /// Whether there is no element.
            pub fn is_empty(&self) -> bool {
                self.len() == 0
            }

            /// An element.
            pub fn get(&self, at: usize) -> Option<Value> {
                match self {
                    $(Self::$kind(items) => items.get(at).copied().map($value),)*
                }
            }

            /// Appends a number of the same type. Returns whether it was one.
            pub fn push(&mut self, value: &Value) -> bool {
                match self {
                    $(Self::$kind(items) => {
                        let number: Option<$number> = $from(value);
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

        impl serde::Serialize for Numbers {
            fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                match self {
                    $(Self::$kind(items) => {
                        serializer.collect_seq(items.iter().copied().map($value))
                    })*
                }
            }
        }
    };
}

fn int<T: TryFrom<i64>>(value: &Value) -> Option<T> {
    match value {
        Value::Int(value) => T::try_from(*value).ok(),
        _ => None,
    }
}

numbers! {
    Bool bool: Value::Bool, |value: &Value| match value { Value::Bool(value) => Some(*value), _ => None };
    I8 i8: |n| Value::Int(n.into()), int;
    U8 u8: |n| Value::Int(n.into()), int;
    I16 i16: |n| Value::Int(n.into()), int;
    U16 u16: |n| Value::Int(n.into()), int;
    I32 i32: |n| Value::Int(n.into()), int;
    U32 u32: |n| Value::Int(n.into()), int;
    I64 i64: Value::Int, int;
    U64 u64: Value::Uint, |value: &Value| match value { Value::Uint(value) => Some(*value), _ => None };
    F32 f32: Value::F32, |value: &Value| match value { Value::F32(value) => Some(*value), _ => None };
    F64 f64: Value::F64, |value: &Value| match value { Value::F64(value) => Some(*value), _ => None };
}
