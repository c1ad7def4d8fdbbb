//! A value of a type that is known at run time.

use crate::error::ValueError;
use crate::numbers::{Element, Numbers};
use crate::types::{Enum, Number, Range, Struct};
use rc_diagnostics::nearest;
use serde::ser::{Serialize, SerializeMap, Serializer};
use std::sync::Arc;

/// A value.
///
/// Numbers of integer types are `Int`, those of `uint64` `Uint`. As JSON, a structure is an object
/// in the order of its members, an enum its name, a missing value `null`, and a number that is not
/// finite a text (`"NaN"`, `"Infinity"`, `"-Infinity"`).
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// A `bool`.
    Bool(bool),
    /// An integer of another type than `uint64`.
    Int(i64),
    /// A `uint64`.
    Uint(u64),
    /// A `float32`.
    F32(f32),
    /// A `float64`.
    F64(f64),
    /// A text.
    Text(String),
    /// The value of an enum.
    Enum(Arc<Enum>, i32),
    /// A sequence or an array of numbers.
    Numbers(Numbers),
    /// A sequence or an array of anything else.
    Sequence(Vec<Value>),
    /// Pairs of key and value.
    Map(Vec<(Value, Value)>),
    /// The values of the members, in their order.
    Struct(Arc<Struct>, Vec<Value>),
    /// An optional value that is missing.
    Missing,
}

impl From<Element> for Value {
    fn from(element: Element) -> Self {
        match element {
            Element::Bool(value) => Self::Bool(value),
            Element::Int(value) => Self::Int(value),
            Element::Uint(value) => Self::Uint(value),
            Element::F32(value) => Self::F32(value),
            Element::F64(value) => Self::F64(value),
        }
    }
}

impl Numbers {
    /// An element.
    pub fn get(&self, at: usize) -> Option<Value> {
        self.element(at).map(Value::from)
    }

    /// Appends a number of the same type. Returns whether it was one.
    pub fn push(&mut self, value: &Value) -> bool {
        let element = match *value {
            Value::Bool(value) => Element::Bool(value),
            Value::Int(value) => Element::Int(value),
            Value::Uint(value) => Element::Uint(value),
            Value::F32(value) => Element::F32(value),
            Value::F64(value) => Element::F64(value),
            _ => return false,
        };
        self.push_element(element)
    }
}

impl Range {
    /// Whether the number is in the range. NaN is in no range. Values of other types always are.
    pub fn contains(self, value: &Value) -> bool {
        let number = match value {
            Value::Int(value) => Number::Int(i128::from(*value)),
            Value::Uint(value) => Number::Int(i128::from(*value)),
            other => match other.number() {
                Some(value) if value.is_nan() => return false,
                Some(value) => Number::Float(value),
                None => return true,
            },
        };
        self.min.is_none_or(|min| number >= min) && self.max.is_none_or(|max| number <= max)
    }
}

impl Serialize for Numbers {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq((0..self.len()).filter_map(|at| self.get(at)))
    }
}

impl Value {
    /// The values of the members of a structure, in their order. `None` for anything else.
    pub fn members(&self) -> Option<&[Value]> {
        let Self::Struct(_, values) = self else {
            return None;
        };
        Some(values)
    }

    /// The elements of a sequence of values. `None` for anything else, also for one of numbers.
    pub fn items(&self) -> Option<&[Value]> {
        let Self::Sequence(items) = self else {
            return None;
        };
        Some(items)
    }

    /// The value at a path: members after dots, elements in brackets, as in `pose.points[3].x`. The
    /// error names the nearest member.
    pub fn field(&self, path: &str) -> Result<Value, ValueError> {
        let mut value = self.clone();
        for step in steps(path)? {
            value = match step {
                Step::Member(name) => value.member(name)?,
                Step::Element(at) => value.element(at)?,
            };
        }
        Ok(value)
    }

    fn member(self, name: &str) -> Result<Value, ValueError> {
        match self {
            Self::Struct(ty, mut values) => match ty.member(name) {
                Some((at, _)) if at < values.len() => Ok(values.swap_remove(at)),
                _ => {
                    let names = ty.members.iter().map(|member| member.name.as_str());
                    let near = nearest(name, names.clone());
                    let all: Vec<&str> = names.collect();
                    let help = match near {
                        Some(near) => format!("did you mean `{near}`?"),
                        None if all.is_empty() => "there are no members".to_owned(),
                        None => format!("the members are {}", all.join(", ")),
                    };
                    Err(ValueError::new(format!(
                        "there is no member `{name}`; {help}"
                    )))
                }
            },
            Self::Map(pairs) => {
                let mut pairs = pairs.into_iter();
                let found = pairs.find(|(key, _)| key.plain() == name);
                let found = found.map(|(_, value)| value);
                found.ok_or_else(|| ValueError::new(format!("there is no key `{name}`")))
            }
            Self::Missing => Ok(Self::Missing),
            _ => Err(ValueError::new(format!(
                "`{name}` is sought in what has no members"
            ))),
        }
    }

    fn element(self, at: usize) -> Result<Value, ValueError> {
        let (found, length) = match self {
            Self::Numbers(numbers) => (numbers.get(at), numbers.len()),
            Self::Sequence(mut items) => {
                let length = items.len();
                ((at < length).then(|| items.swap_remove(at)), length)
            }
            Self::Missing => return Ok(Self::Missing),
            _ => {
                return Err(ValueError::new(format!(
                    "[{at}] is sought in what has no elements"
                )));
            }
        };
        found.ok_or_else(|| {
            ValueError::new(format!("there is no element [{at}]; there are {length}"))
        })
    }

    /// A number, a text, a `bool` or an enum as a text without quotes; empty for others.
    pub fn plain(&self) -> String {
        match self {
            Self::Bool(value) => value.to_string(),
            Self::Int(value) => value.to_string(),
            Self::Uint(value) => value.to_string(),
            Self::F32(value) => value.to_string(),
            Self::F64(value) => value.to_string(),
            Self::Text(value) => value.clone(),
            Self::Enum(of, number) => match of.name_of(*number) {
                Some(name) => name.to_owned(),
                None => number.to_string(),
            },
            Self::Numbers(_)
            | Self::Sequence(_)
            | Self::Map(_)
            | Self::Struct(..)
            | Self::Missing => String::new(),
        }
    }

    /// The value as a number, if it is one.
    pub fn number(&self) -> Option<f64> {
        Some(match self {
            Self::Bool(value) => f64::from(u8::from(*value)),
            Self::Int(value) => *value as f64,
            Self::Uint(value) => *value as f64,
            Self::F32(value) => f64::from(*value),
            Self::F64(value) => *value,
            Self::Enum(_, number) => f64::from(*number),
            _ => return None,
        })
    }
}

enum Step<'p> {
    Member(&'p str),
    Element(usize),
}

fn steps(path: &str) -> Result<Vec<Step<'_>>, ValueError> {
    let wrong = || {
        ValueError::new(format!(
            "`{path}` is not a path; write members after dots and elements in brackets, as in `pose.points[3].x`"
        ))
    };
    let mut steps = Vec::new();
    for part in path.split('.') {
        let mut rest = part;
        let name = rest.split('[').next().unwrap_or_default();
        rest = &rest[name.len()..];
        if name.is_empty() && (rest.is_empty() || !steps.is_empty()) {
            return Err(wrong());
        }
        if !name.is_empty() {
            steps.push(Step::Member(name));
        }
        while let Some(inner) = rest.strip_prefix('[') {
            let (number, behind) = inner.split_once(']').ok_or_else(wrong)?;
            steps.push(Step::Element(number.parse().map_err(|_| wrong())?));
            rest = behind;
        }
        if !rest.is_empty() {
            return Err(wrong());
        }
    }
    Ok(steps)
}

/// The word for a number that JSON does not have.
pub(crate) fn word(value: f64) -> Option<&'static str> {
    if value.is_nan() {
        Some("NaN")
    } else if value == f64::INFINITY {
        Some("Infinity")
    } else if value == f64::NEG_INFINITY {
        Some("-Infinity")
    } else {
        None
    }
}

impl Serialize for Value {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Bool(value) => serializer.serialize_bool(*value),
            Self::Int(value) => serializer.serialize_i64(*value),
            Self::Uint(value) => serializer.serialize_u64(*value),
            Self::F32(value) => match word(f64::from(*value)) {
                Some(word) => serializer.serialize_str(word),
                None => serializer.serialize_f32(*value),
            },
            Self::F64(value) => match word(*value) {
                Some(word) => serializer.serialize_str(word),
                None => serializer.serialize_f64(*value),
            },
            Self::Text(value) => serializer.serialize_str(value),
            Self::Enum(..) => serializer.serialize_str(&self.plain()),
            Self::Numbers(numbers) => numbers.serialize(serializer),
            Self::Sequence(items) => serializer.collect_seq(items),
            Self::Map(pairs) => {
                serializer.collect_map(pairs.iter().map(|(key, value)| (key.plain(), value)))
            }
            Self::Struct(ty, values) => {
                let mut map = serializer.serialize_map(Some(values.len()))?;
                for (member, value) in ty.members.iter().zip(values) {
                    map.serialize_entry(&member.name, value)?;
                }
                map.end()
            }
            Self::Missing => serializer.serialize_none(),
        }
    }
}
