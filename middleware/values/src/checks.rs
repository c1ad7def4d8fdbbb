//! Checks whether a value belongs to its type.

use crate::error::ValueError;
use crate::types::Member;
use crate::value::Value;

/// Fails if a number is outside the range of its member.
pub(crate) fn check_range(member: &Member, value: &Value) -> Result<(), ValueError> {
    match member.range {
        Some(range) if !range.contains(value) => {
            let unit = member
                .unit
                .as_deref()
                .map_or(String::new(), |u| format!(" {u}"));
            let number = written(value);
            Err(ValueError::new(format!(
                "{number} is outside its range {range}{unit}"
            )))
        }
        _ => Ok(()),
    }
}

/// A number with all its digits.
pub fn written(value: &Value) -> String {
    match value {
        Value::Int(value) => value.to_string(),
        Value::Uint(value) => value.to_string(),
        other => other.number().map_or(String::new(), |n| n.to_string()),
    }
}

/// Fails if there are more elements than the type allows.
pub(crate) fn check_bound(length: usize, bound: Option<u32>) -> Result<(), ValueError> {
    match bound {
        Some(bound) if length > bound as usize => Err(ValueError::new(format!(
            "it has {length} elements, its type allows {bound}"
        ))),
        _ => Ok(()),
    }
}

/// The number of elements of a sequence.
pub(crate) fn count(value: &Value) -> Option<usize> {
    match value {
        Value::Numbers(numbers) => Some(numbers.len()),
        Value::Sequence(items) => Some(items.len()),
        _ => None,
    }
}

/// A value that has another type than its member.
pub(crate) fn misfit(expected: impl std::fmt::Display) -> ValueError {
    ValueError::new(format!("the value is no {expected}"))
}
