//! Types with all names resolved.

use crate::quick::Quick;
pub use rc_vocabulary::{Layout, Number, Primitive};
use std::fmt;
use std::sync::{Arc, OnceLock};

/// A type.
pub type Type = rc_vocabulary::Type<Named>;

/// A type with a name.
#[derive(Clone, Debug, PartialEq)]
pub enum Named {
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
    /// Its parts, if they are simple, from the first copy of a body on.
    quick: OnceLock<Option<Quick>>,
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
    pub min: Option<Number>,
    /// The largest one.
    pub max: Option<Number>,
}

/// The limit of a number of a type as JSON writes it. The `0.0` of an integer is 0. The limit of a
/// float is the nearest `f64`, as in generated code.
pub(crate) fn limit(number: &serde_json::Number, is_integer: bool) -> Number {
    let float = number.as_f64().unwrap_or(f64::NAN);
    match number.as_i128() {
        Some(whole) if is_integer => Number::Int(whole),
        None if is_integer && float.fract() == 0.0 => Number::Int(float as i128),
        Some(_) | None => Number::Float(float),
    }
}

/// A limit as JSON; none for one that is not finite. Only integers that no `f64` holds are written
/// without a point.
pub fn limit_json(limit: Number) -> Option<serde_json::Number> {
    match limit {
        Number::Int(value) if value.unsigned_abs() > 1 << f64::MANTISSA_DIGITS => {
            serde_json::Number::from_i128(value)
        }
        Number::Int(_) | Number::Float(_) => serde_json::Number::from_f64(limit.as_float()),
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
        let depth = members.iter().map(|member| depth(&member.ty)).max();
        let layouts: Option<Vec<Layout>> = members.iter().map(Member::layout).collect();
        let layout = layouts.filter(|parts| !parts.is_empty());
        Self {
            name,
            quick: OnceLock::new(),
            members,
            layout: layout.map(Layout::structure).filter(|layout| layout.fits()),
            depth: depth.unwrap_or(0),
        }
    }

    /// Its parts, if they are simple.
    pub(crate) fn quick(&self) -> Option<&Quick> {
        let quick = self.quick.get_or_init(|| Quick::of(&self.members));
        quick.as_ref()
    }

    /// A member and its index.
    pub fn member(&self, name: &str) -> Option<(usize, &Member)> {
        let mut members = self.members.iter().enumerate();
        members.find(|(_, member)| member.name == name)
    }
}

impl fmt::Display for Named {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Enum(of) => f.write_str(&of.name),
            Self::Struct(of) => f.write_str(&of.name),
        }
    }
}

/// The memory image of a type, if the type determines its size and values of it can travel.
pub fn layout(ty: &Type) -> Option<Layout> {
    let image = ty.layout(&|named| match named {
        Named::Enum(_) => Some(Layout::ENUM),
        Named::Struct(of) => of.layout,
    });
    image.filter(|image| image.fits())
}

/// The levels of types inside a type.
pub(crate) fn depth(ty: &Type) -> u32 {
    match ty {
        Type::Primitive(_) | Type::Text { .. } | Type::Named(Named::Enum(_)) => 0,
        Type::Sequence { element, .. } | Type::Array { element, .. } => 1 + depth(element),
        Type::Dictionary { key, value } => 1 + depth(key).max(depth(value)),
        Type::Named(Named::Struct(of)) => 1 + of.depth,
    }
}

impl Member {
    /// Memory image: an optional value is a sequence of at most one.
    pub fn layout(&self) -> Option<Layout> {
        let value = layout(&self.ty)?;
        if self.optional {
            Some(Layout::sequence(value, 1)).filter(|layout| layout.fits())
        } else {
            Some(value)
        }
    }
}
