//! Values of attributes in the types of Rust. `None` where a value has another type, which only an open
//! schema allows.

use property_graph::Value;
use rc_world::property_graph::Sample;
use std::borrow::Cow;
use std::sync::Arc;

/// Yes or no.
pub fn boolean(value: &Value) -> Option<bool> {
    match value {
        Value::Bool(value) => Some(*value),
        _ => None,
    }
}

/// An integer.
pub fn integer(value: &Value) -> Option<i64> {
    value.as_i64()
}

/// A number.
pub fn number(value: &Value) -> Option<f64> {
    value.as_f64()
}

/// A text.
pub fn text(value: &Value) -> Option<&str> {
    value.as_str()
}

/// Bytes.
pub fn bytes(value: &Value) -> Option<&[u8]> {
    match value {
        Value::Bytes(all) => Some(all),
        _ => None,
    }
}

/// Integers.
pub fn integers(value: &Value) -> Option<&[i64]> {
    match value {
        Value::Ints(all) => Some(all),
        _ => None,
    }
}

/// This many numbers.
pub fn numbers<const N: usize>(value: &Value) -> Option<[f64; N]> {
    let all = value.numbers()?;
    all.as_ref().try_into().ok()
}

/// Numbers.
pub fn all_numbers(value: &Value) -> Option<Cow<'_, [f64]>> {
    value.numbers()
}

/// Texts.
pub fn texts(value: &Value) -> Option<&[Arc<str>]> {
    match value {
        Value::Texts(all) => Some(all),
        _ => None,
    }
}

/// A reference to a sample of a topic.
pub fn sample(value: &Value) -> Option<&Sample> {
    match value {
        Value::Sample(sample) => Some(sample),
        _ => None,
    }
}
