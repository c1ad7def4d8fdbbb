//! Parameters of a running component as tools get them.

use crate::foreign;
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// One parameter. The values of a secret one are `***`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ParameterStatus {
    /// The path, `motors[2].max`.
    #[serde(deserialize_with = "foreign::text")]
    pub path: String,
    /// The value.
    pub value: Value,
    /// The value of the next start, if that is another one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pending: Option<Value>,
    /// Whether the value of the next start is missing in the configuration file, as far as the
    /// component knows.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub unsaved: bool,
    /// The default value; none if the configuration must give a value.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub default: Option<Value>,
    /// The type and the limits, in the words of PDSL: "float, from 0 to 1500, in mm/s".
    #[serde(deserialize_with = "foreign::text")]
    pub allowed: String,
    /// The unit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[serde(deserialize_with = "foreign::optional")]
    pub unit: Option<String>,
    /// Whether a change takes effect at once.
    pub editable: bool,
    /// Whether a change takes effect at the next start.
    pub restart: bool,
    /// Whether the values are never shown.
    pub secret: bool,
    /// The documentation, line by line.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[serde(deserialize_with = "foreign::texts")]
    pub doc: Vec<String>,
}

impl ParameterStatus {
    /// Whether the value is one text, which a command line gives without quotes.
    pub fn is_text(&self) -> bool {
        let ty = self.allowed.split([',', ' ']).next().unwrap_or_default();
        // An element of an array has the type of the array.
        let element = ty.strip_suffix("[]").filter(|_| self.path.ends_with(']'));
        matches!(element.unwrap_or(ty), "string" | "path")
    }
}

/// One changed value.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ParameterChange {
    /// The path of the parameter.
    #[serde(deserialize_with = "foreign::text")]
    pub path: String,
    /// The value before; `***` if it is secret.
    pub old: Value,
    /// The value after; `***` if it is secret.
    pub new: Value,
}

/// Whether one of two paths is the other one, or leads to an element or a member of it: `motors`,
/// `motors[2]` and `motors.max` overlap `motors[2].max`. Indices do not count.
pub fn overlap(one: &str, other: &str) -> bool {
    fn names(path: &str) -> impl Iterator<Item = &str> {
        path.split('.')
            .map(|name| name.split('[').next().unwrap_or(name))
    }
    names(one)
        .zip(names(other))
        .all(|(one, other)| one == other)
}
