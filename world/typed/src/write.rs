//! Values of attributes that no plain Rust type is.

use crate::Value;

/// A list of whole numbers.
pub fn integers(value: &[i64]) -> Value {
    Value::Ints(value.into())
}

/// A list of texts.
pub fn texts(value: &[&str]) -> Value {
    Value::Texts(value.iter().map(|text| (*text).into()).collect())
}
