//! The value of a setting.

use crate::duration;
use crate::qos;
use crate::ros::Remapping;
use std::fmt;
use std::time::Duration;

/// The value of a setting, converted and checked.
///
/// It prints as a command line takes it, and [`Kind::parse`](crate::Kind::parse) reads that
/// again: numbers are decimal, durations have a unit, the elements of a list have commas between
/// them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Value {
    /// `true` or `false`.
    Bool(bool),
    /// A whole number.
    Int(i64),
    /// A duration, exact to the nanosecond.
    Duration(Duration),
    /// A name.
    Text(String),
    /// Names or addresses, in the order of the text.
    Texts(Vec<String>),
    /// Rules for names in ROS 2. The first matching rule applies.
    Remappings(Vec<Remapping>),
    /// Rules for the quality of service of topics. The first matching rule applies.
    Qos(Vec<qos::Rule>),
}

impl Value {
    /// Appends the elements of `other`, if both are lists of the same kind.
    pub fn append(&mut self, other: Self) {
        match (self, other) {
            (Self::Texts(all), Self::Texts(more)) => all.extend(more),
            (Self::Remappings(all), Self::Remappings(more)) => all.extend(more),
            (Self::Qos(all), Self::Qos(more)) => all.extend(more),
            _ => {}
        }
    }
}

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Bool(value) => value.fmt(f),
            Self::Int(value) => value.fmt(f),
            Self::Duration(value) => f.write_str(&duration::text_of(*value)),
            Self::Text(value) => f.write_str(value),
            Self::Texts(values) => list(f, values),
            Self::Remappings(rules) => list(f, rules),
            Self::Qos(rules) => list(f, rules),
        }
    }
}

fn list(f: &mut fmt::Formatter<'_>, elements: &[impl fmt::Display]) -> fmt::Result {
    for (at, element) in elements.iter().enumerate() {
        let comma = if at == 0 { "" } else { "," };
        write!(f, "{comma}{element}")?;
    }
    Ok(())
}
