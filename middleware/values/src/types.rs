//! Types with all names resolved.

use crate::value::Value;
pub use rc_vocabulary::{Layout, Primitive};
use serde_json::Number;
use std::fmt;
use std::sync::Arc;

/// A type.
#[derive(Clone, Debug, PartialEq)]
pub enum Type {
    /// A number or a `bool`.
    Primitive(Primitive),
    /// Text in UTF-8.
    Text {
        /// The largest number of bytes.
        bound: Option<u32>,
    },
    /// Any number of elements.
    Sequence {
        /// Their type.
        element: Arc<Type>,
        /// The largest number of elements.
        bound: Option<u32>,
    },
    /// A fixed number of elements.
    Array {
        /// Their type.
        element: Arc<Type>,
        /// Their number.
        length: u32,
    },
    /// Pairs of key and value.
    Map {
        /// The type of keys.
        key: Arc<Type>,
        /// The type of values.
        value: Arc<Type>,
    },
    /// Numbers with names.
    Enum(Arc<Enum>),
    /// Members in order.
    Struct(Arc<Struct>),
}

/// Numbers with names; an int32 on the wire.
#[derive(Clone, Debug, PartialEq)]
pub struct Enum {
    /// The name with its module, `RoboCompSpeech::Voice`.
    pub name: String,
    /// The names with their numbers. The first one is the default.
    pub values: Vec<(String, i32)>,
}

/// A structure, an exception, or the parameters of an operation. Equal if the names are: the types
/// of one catalog have different names.
#[derive(Clone, Debug)]
pub struct Struct {
    /// The name with its module, `RoboCompLaser::TData`; for parameters, the name of the operation.
    pub name: String,
    /// The members, in their order.
    pub members: Vec<Member>,
    /// The memory image, if the type determines its size.
    pub layout: Option<Layout>,
    /// The levels of types inside it.
    pub(crate) depth: u32,
}

/// A member of a structure.
#[derive(Clone, Debug, PartialEq)]
pub struct Member {
    /// The name.
    pub name: String,
    /// The type.
    pub ty: Type,
    /// Whether the value may be missing.
    pub optional: bool,
    /// The unit.
    pub unit: Option<String>,
    /// The allowed numbers.
    pub range: Option<Range>,
    /// The default as JSON of the type, where it is not that of the type.
    pub default: Option<serde_json::Value>,
}

/// The allowed values of a number, ends included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// The smallest one.
    pub min: Option<Limit>,
    /// The largest one.
    pub max: Option<Limit>,
}

/// An end of a range. Integers are compared exactly: those of 64 bits have more digits than an
/// `f64`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Limit {
    /// Of an integer.
    Integer(i128),
    /// Of a floating-point number.
    Float(f64),
}

impl Limit {
    /// The limit of a number of a type as JSON writes it. The `0.0` of an integer is 0.
    pub(crate) fn of(number: &Number, is_integer: bool) -> Self {
        let whole = number.as_i128();
        let float = number.as_f64().unwrap_or(f64::NAN);
        match whole {
            Some(whole) => Self::Integer(whole),
            None if is_integer && float.fract() == 0.0 => Self::Integer(float as i128),
            None => Self::Float(float),
        }
    }

    /// The number as JSON; none for one that is not finite. Only integers that no `f64` holds are
    /// written without a point.
    pub fn json(self) -> Option<Number> {
        match self {
            Self::Integer(value) if value.unsigned_abs() > 1 << f64::MANTISSA_DIGITS => {
                Number::from_i128(value)
            }
            Self::Integer(value) => Number::from_f64(value as f64),
            Self::Float(value) => Number::from_f64(value),
        }
    }

    fn float(self) -> f64 {
        match self {
            Self::Integer(value) => value as f64,
            Self::Float(value) => value,
        }
    }
}

impl fmt::Display for Limit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Integer(value) => value.fmt(f),
            Self::Float(value) => value.fmt(f),
        }
    }
}

impl Range {
    /// Whether it has this number; NaN is in no range. Values that are no numbers have none.
    pub fn contains(self, value: &Value) -> bool {
        let integer = match value {
            Value::Int(value) => Some(i128::from(*value)),
            Value::Uint(value) => Some(i128::from(*value)),
            _ => None,
        };
        let Some(float) = value.number() else {
            return true;
        };
        let is_below = |limit: Limit| match (limit, integer) {
            (Limit::Integer(limit), Some(value)) => value < limit,
            _ => float < limit.float(),
        };
        let is_above = |limit: Limit| match (limit, integer) {
            (Limit::Integer(limit), Some(value)) => value > limit,
            _ => float > limit.float(),
        };
        !float.is_nan() && !self.min.is_some_and(is_below) && !self.max.is_some_and(is_above)
    }
}

impl fmt::Display for Range {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.min, self.max) {
            (Some(min), Some(max)) => write!(f, "{min} to {max}"),
            (Some(min), None) => write!(f, "at least {min}"),
            (None, Some(max)) => write!(f, "at most {max}"),
            (None, None) => f.write_str("any number"),
        }
    }
}

impl Enum {
    /// The name of a number.
    pub fn name_of(&self, number: i32) -> Option<&str> {
        let found = self.values.iter().find(|(_, value)| *value == number);
        found.map(|(name, _)| name.as_str())
    }

    /// The number of a name.
    pub fn number_of(&self, name: &str) -> Option<i32> {
        let found = self.values.iter().find(|(known, _)| known == name);
        found.map(|(_, number)| *number)
    }
}

impl PartialEq for Struct {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

impl Struct {
    /// A structure with these members, whose names differ.
    pub fn new(name: String, members: Vec<Member>) -> Self {
        let depth = members.iter().map(|member| member.ty.depth()).max();
        let layouts: Option<Vec<Layout>> = members.iter().map(Member::layout).collect();
        let layout = layouts.filter(|parts| !parts.is_empty());
        Self {
            name,
            members,
            layout: layout.map(Layout::structure).filter(|layout| layout.fits()),
            depth: depth.unwrap_or(0),
        }
    }

    /// A member and its index.
    pub fn member(&self, name: &str) -> Option<(usize, &Member)> {
        let mut members = self.members.iter().enumerate();
        members.find(|(_, member)| member.name == name)
    }
}

impl fmt::Display for Type {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Primitive(primitive) => f.write_str(primitive.word()),
            Self::Text { bound: None } => f.write_str("string"),
            Self::Text { bound: Some(bound) } => write!(f, "string<{bound}>"),
            Self::Sequence {
                element,
                bound: None,
            } => write!(f, "sequence<{element}>"),
            Self::Sequence {
                element,
                bound: Some(bound),
            } => write!(f, "sequence<{element},{bound}>"),
            Self::Array { element, length } => write!(f, "{element}[{length}]"),
            Self::Map { key, value } => write!(f, "dictionary<{key},{value}>"),
            Self::Enum(of) => f.write_str(&of.name),
            Self::Struct(of) => f.write_str(&of.name),
        }
    }
}

impl Type {
    /// Memory image, if the type determines its size and values of it can travel.
    pub fn layout(&self) -> Option<Layout> {
        let layout = match self {
            Self::Primitive(primitive) => Layout::number(primitive.size()),
            Self::Text { bound } => Layout::text((*bound)?),
            Self::Sequence { element, bound } => Layout::sequence(element.layout()?, (*bound)?),
            Self::Array { element, length } => element.layout()?.times(*length),
            Self::Map { .. } => return None,
            Self::Enum(_) => Layout::ENUM,
            Self::Struct(of) => of.layout?,
        };
        layout.fits().then_some(layout)
    }

    /// The levels of types inside it.
    pub(crate) fn depth(&self) -> u32 {
        match self {
            Self::Primitive(_) | Self::Text { .. } | Self::Enum(_) => 0,
            Self::Sequence { element, .. } | Self::Array { element, .. } => 1 + element.depth(),
            Self::Map { key, value } => 1 + key.depth().max(value.depth()),
            Self::Struct(of) => 1 + of.depth,
        }
    }
}

impl Member {
    /// Memory image: an optional value is a sequence of at most one.
    pub fn layout(&self) -> Option<Layout> {
        let value = self.ty.layout()?;
        if self.optional {
            Some(Layout::sequence(value, 1)).filter(|layout| layout.fits())
        } else {
            Some(value)
        }
    }
}
