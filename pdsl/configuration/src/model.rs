//! The parameters of a component: the model that generated code embeds and that configurations
//! are checked against.

use crate::condition::Condition;
pub use crate::value::Value;
use rc_diagnostics::nearest;
use rc_vocabulary::duration;
use serde::{Deserialize, Serialize};
use std::fmt::Write;

/// All parameters of a component.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Parameters {
    /// The name after `ComponentParams`.
    pub name: String,
    /// The documentation, line by line.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub doc: Vec<String>,
    /// The parameters in the order of the text.
    pub parameters: Vec<Parameter>,
    /// The rules across parameters.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub rules: Vec<Rule>,
}

impl Parameters {
    /// Whether any parameter is secret.
    pub fn has_secrets(&self) -> bool {
        self.parameters.iter().any(Parameter::has_secrets)
    }

    /// Serialises the model as one line of JSON, for [`Parameters::from_json`].
    pub fn to_json(&self) -> String {
        // Serialization fails only for maps whose keys are not strings, and there are none.
        serde_json::to_string(self).unwrap_or_default()
    }

    /// Deserialises the result of [`Parameters::to_json`].
    pub fn from_json(text: &str) -> Result<Self, serde_json::Error> {
        serde_json::from_str(text)
    }
}

/// A `require` rule.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rule {
    /// The groups and lists around the rule, the outermost first. In a list, the rule applies to
    /// each element.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub scope: Vec<String>,
    /// The condition that must hold.
    pub condition: Condition,
    /// The text of the condition, for messages.
    pub text: String,
    /// The message if the condition does not hold.
    pub message: String,
}

/// A parameter, a group or a list.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Parameter {
    /// The name.
    pub name: String,
    /// The documentation, line by line.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub doc: Vec<String>,
    /// The kind, with type or members.
    pub kind: Kind,
    /// The default. A scalar or an array without a default is required.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub default: Option<Value>,
    /// The allowed range of a number or a duration, or of the elements of an array.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub range: Option<Range>,
    /// The only allowed values or elements. If empty, there is no such limit.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub choices: Vec<Value>,
    /// The unit of a number, for users.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    /// `T`: whether a change takes effect at once.
    #[serde(default, skip_serializing_if = "is_false")]
    pub editable: bool,
    /// `restart`: whether a change takes effect at the next start.
    #[serde(default, skip_serializing_if = "is_false")]
    pub restart: bool,
    /// `secret`: whether the value is never shown.
    #[serde(default, skip_serializing_if = "is_false")]
    pub secret: bool,
    /// `reads`: the kind of the file that the component reads when it starts.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reads: Option<FileKind>,
    /// `element`: the value names an element of such a file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub element: Option<Element>,
}

/// What a tool can check about a file that a parameter names.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FileKind {
    /// A file that can be read, whatever it contains.
    File,
    /// A tree of InnerModel.
    Innermodel,
    /// A map of the crate `planar_map`.
    PlanarMap,
    /// A folder in which files that other files name are looked for. It need not exist.
    Search,
}

impl FileKind {
    /// All kinds with their names.
    pub const WORDS: [(&'static str, Self); 4] = [
        ("file", Self::File),
        ("innermodel", Self::Innermodel),
        ("planar_map", Self::PlanarMap),
        ("search", Self::Search),
    ];
}

/// An element of a file that another parameter names.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Element {
    /// The kind of the element.
    pub kind: ElementKind,
    /// The parameter that names the file; it is in no group.
    pub of: String,
}

/// Kinds of elements of an InnerModel file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ElementKind {
    /// Any node.
    Node,
    /// A joint: a node with a position.
    Joint,
}

impl ElementKind {
    /// All kinds with their names.
    pub const WORDS: [(&'static str, Self); 2] = [("node", Self::Node), ("joint", Self::Joint)];

    /// The name of the kind.
    pub fn word(self) -> &'static str {
        match self {
            Self::Node => "node",
            Self::Joint => "joint",
        }
    }
}

#[expect(
    clippy::trivially_copy_pass_by_ref,
    reason = "serde calls it with a reference"
)]
fn is_false(value: &bool) -> bool {
    !*value
}

/// The kind of a parameter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// One value, or an array of values.
    Scalar {
        /// The type of the value, or of the elements of an array.
        #[serde(rename = "type")]
        ty: Type,
        /// The allowed length of an array; `None` for a single value.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        array: Option<Length>,
    },
    /// A group of parameters.
    Group(Vec<Parameter>),
    /// A list of structures.
    List {
        /// The allowed length.
        length: Length,
        /// The parameters of each element.
        parameters: Vec<Parameter>,
    },
}

/// The allowed number of elements.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Length {
    /// The minimum.
    pub min: u32,
    /// The maximum; `None` for no limit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub max: Option<u32>,
}

impl Length {
    /// Whether `count` elements are allowed.
    pub fn allows(self, count: usize) -> bool {
        count >= self.min as usize && self.max.is_none_or(|max| count <= max as usize)
    }

    /// "1 to 8 elements", for messages.
    pub fn described(self) -> String {
        match (self.min, self.max) {
            (1, Some(1)) => "1 element".to_owned(),
            (min, Some(max)) if min == max => format!("{min} elements"),
            (min, Some(max)) => format!("{min} to {max} elements"),
            (0, None) => "any number of elements".to_owned(),
            (min, None) => format!("at least {min} elements"),
        }
    }
}

/// The types of parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Type {
    /// `true` or `false`
    Bool,
    /// An integer of 32 bits.
    Int,
    /// An integer of 64 bits.
    Long,
    /// A floating-point number of 32 bits.
    Float,
    /// A floating-point number of 64 bits.
    Double,
    /// A string.
    String,
    /// A duration.
    Duration,
    /// A path in the file system.
    Path,
}

/// Why a value does not have a type.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ConversionError {
    /// It has another type.
    WrongType,
    /// It is a number that the type cannot hold.
    OutOfRange,
}

impl Type {
    /// All types with their names.
    pub const WORDS: [(&'static str, Self); 8] = [
        ("bool", Self::Bool),
        ("int", Self::Int),
        ("long", Self::Long),
        ("float", Self::Float),
        ("double", Self::Double),
        ("string", Self::String),
        ("duration", Self::Duration),
        ("path", Self::Path),
    ];

    /// The type of that name, in upper or lower case.
    pub fn from_word(word: &str) -> Option<Self> {
        Self::WORDS
            .iter()
            .find(|(w, _)| w.eq_ignore_ascii_case(word))
            .map(|(_, ty)| *ty)
    }

    /// The name of the type.
    pub fn word(self) -> &'static str {
        Self::WORDS
            .iter()
            .find(|(_, ty)| *ty == self)
            .map_or("", |(word, _)| word)
    }

    /// Whether the values are numbers, which may have a unit.
    pub fn is_number(self) -> bool {
        matches!(self, Self::Int | Self::Long | Self::Float | Self::Double)
    }

    /// Whether a range can limit the values.
    pub fn is_ordered(self) -> bool {
        self.is_number() || self == Self::Duration
    }

    /// The values of the type, for messages.
    pub fn described(self) -> &'static str {
        match self {
            Self::Bool => "`true` or `false`",
            Self::Int => "an integer of 32 bits",
            Self::Long => "an integer of 64 bits",
            Self::Float => "a number of 32 bits",
            Self::Double => "a number of 64 bits",
            Self::String => "a string",
            Self::Duration => "a duration such as \"50ms\", or a number of milliseconds",
            Self::Path => "a path as a string",
        }
    }

    /// Converts a value into this type. An integer is also a number; a duration may be a string
    /// or a number of milliseconds.
    pub fn convert(self, value: &Value) -> Result<Value, ConversionError> {
        Ok(match (self, value) {
            // A duration that is too long was read as the longest one.
            (Self::Duration, Value::Duration(u64::MAX)) => return Err(ConversionError::OutOfRange),
            // An infinity is kept. A finite number that rounds to an infinity is too large.
            (Self::Float, Value::Float(float))
                if float.is_finite() && (*float as f32).is_infinite() =>
            {
                return Err(ConversionError::OutOfRange);
            }
            (Self::Bool, Value::Bool(_))
            | (Self::Long, Value::Int(_))
            | (Self::Float | Self::Double, Value::Float(_))
            | (Self::Duration, Value::Duration(_))
            | (Self::String | Self::Path, Value::Text(_)) => value.clone(),
            (Self::Int, Value::Int(int)) => {
                i32::try_from(*int).map_err(|_| ConversionError::OutOfRange)?;
                value.clone()
            }
            (Self::Double | Self::Float, Value::Int(int)) => Value::Float(*int as f64),
            (Self::Duration, Value::Text(text)) => {
                let ns = duration::parse(text).ok_or(ConversionError::WrongType)?;
                return self.convert(&Value::Duration(ns));
            }
            (Self::Duration, Value::Int(ms)) => Value::Duration(
                duration::from_milliseconds(*ms).ok_or(ConversionError::OutOfRange)?,
            ),
            (Self::Duration, Value::Float(ms)) => Value::Duration(
                duration::from_fractional_milliseconds(*ms).ok_or(ConversionError::OutOfRange)?,
            ),
            _ => return Err(ConversionError::WrongType),
        })
    }
}

/// Inclusive limits. They have the type of the parameter, so that integers stay exact.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Range {
    /// The minimum.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub min: Option<Value>,
    /// The maximum.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub max: Option<Value>,
}

impl Range {
    /// Whether `value` is in the range. NaN is in no range.
    pub fn contains(&self, value: &Value) -> bool {
        self.min.as_ref().is_none_or(|min| at_most(min, value))
            && self.max.as_ref().is_none_or(|max| at_most(value, max))
    }

    /// The limit that a value outside exceeds. `None` for one that has no order with the limits.
    pub fn nearest(&self, value: &Value) -> Option<&Value> {
        let below = self.min.as_ref().filter(|min| at_most(value, min));
        below.or_else(|| self.max.as_ref().filter(|max| at_most(max, value)))
    }

    /// "from 0 to 127", for messages.
    pub fn described(&self) -> String {
        let text = |value: &Value| match value {
            Value::Float(float) => float.to_string(),
            Value::Duration(ns) => duration::text(*ns),
            other => other.to_toml(),
        };
        match (&self.min, &self.max) {
            (Some(min), Some(max)) => format!("from {} to {}", text(min), text(max)),
            (Some(min), None) => format!("at least {}", text(min)),
            (None, Some(max)) => format!("at most {}", text(max)),
            (None, None) => "any".to_owned(),
        }
    }
}

fn at_most(a: &Value, b: &Value) -> bool {
    match (a, b) {
        (Value::Int(a), Value::Int(b)) => a <= b,
        (Value::Duration(a), Value::Duration(b)) => a <= b,
        (Value::Float(a), Value::Float(b)) => a <= b,
        _ => false,
    }
}

impl Parameter {
    /// A required parameter without limits.
    pub fn new(name: impl Into<String>, kind: Kind) -> Self {
        Self {
            name: name.into(),
            doc: Vec::new(),
            kind,
            default: None,
            range: None,
            choices: Vec::new(),
            unit: None,
            editable: false,
            restart: false,
            secret: false,
            reads: None,
            element: None,
        }
    }

    /// The allowed values, for messages: "an integer of 32 bits, from 0 to 127".
    pub fn allowed(&self) -> String {
        match &self.kind {
            Kind::Scalar { ty, array: None } => format!("{}{}", ty.described(), self.limits()),
            Kind::Scalar {
                ty,
                array: Some(length),
            } => {
                format!(
                    "an array, {}, each {}{}",
                    length.described(),
                    ty.described(),
                    self.limits()
                )
            }
            Kind::Group(_) => "a table".to_owned(),
            Kind::List { length, .. } => format!("a list of tables, {}", length.described()),
        }
    }

    /// The allowed values of a scalar or an element of an array, and the choice that is nearest
    /// to `value`.
    pub fn allowed_near(&self, value: &Value) -> String {
        let mut text = match &self.kind {
            Kind::Scalar { ty, .. } => format!("{}{}", ty.described(), self.limits()),
            Kind::Group(_) | Kind::List { .. } => self.allowed(),
        };
        let texts = self.choices.iter().filter_map(Value::as_text);
        if let Some(near) = value.as_text().and_then(|written| nearest(written, texts)) {
            let _ = write!(text, "; did you mean `{near}`?");
        }
        text
    }

    /// The type and the limits in the words of PDSL: "int, from 0 to 127".
    pub fn summary(&self) -> String {
        match &self.kind {
            Kind::Scalar { ty, array: None } => format!("{}{}", ty.word(), self.limits()),
            Kind::Scalar {
                ty,
                array: Some(length),
            } => {
                format!("{}[], {}{}", ty.word(), length.described(), self.limits())
            }
            Kind::Group(_) => "group".to_owned(),
            Kind::List { length, .. } => format!("list, {}", length.described()),
        }
    }

    /// When a change takes effect, for users. `None` if the parameter is fixed at the start.
    pub fn change(&self) -> Option<&'static str> {
        match (self.restart, self.editable) {
            (true, _) => Some("a change takes effect at the next start"),
            (false, true) => Some("may be changed while the component runs"),
            (false, false) => None,
        }
    }

    /// Whether a configuration must set the parameter.
    pub fn is_required(&self) -> bool {
        match &self.kind {
            Kind::Scalar { .. } => self.default.is_none(),
            Kind::Group(members) => members.iter().any(Self::is_required),
            Kind::List { length, .. } => length.min > 0,
        }
    }

    /// Whether the value, or a value in it, is secret.
    pub fn has_secrets(&self) -> bool {
        match &self.kind {
            Kind::Scalar { .. } => self.secret,
            Kind::Group(members)
            | Kind::List {
                parameters: members,
                ..
            } => members.iter().any(Self::has_secrets),
        }
    }

    fn limits(&self) -> String {
        let mut text = String::new();
        if !self.choices.is_empty() {
            let choices: Vec<String> = self.choices.iter().map(Value::to_toml).collect();
            let _ = write!(text, ", one of {}", choices.join(", "));
        } else if let Some(range) = &self.range {
            let _ = write!(text, ", {}", range.described());
        }
        if let Some(unit) = &self.unit {
            let _ = write!(text, ", in {unit}");
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_length_is_described_as_it_is_judged() {
        let length = |min, max| Length { min, max };
        for (length, text, allowed) in [
            (length(1, Some(1)), "1 element", vec![1]),
            (length(2, Some(2)), "2 elements", vec![2]),
            (length(0, Some(2)), "0 to 2 elements", vec![0, 1, 2]),
            (length(1, Some(3)), "1 to 3 elements", vec![1, 2, 3]),
            (length(0, None), "any number of elements", (0..9).collect()),
            (length(2, None), "at least 2 elements", (2..9).collect()),
        ] {
            assert_eq!(length.described(), text);
            let counts = (0..9).filter(|count| length.allows(*count));
            assert_eq!(counts.collect::<Vec<_>>(), allowed, "{text}");
        }
        for (word, kind) in ElementKind::WORDS {
            assert_eq!(kind.word(), word);
        }
    }

    #[test]
    fn a_number_for_a_duration_counts_milliseconds() {
        let converted = |value| Type::Duration.convert(&value);
        let ns = |ns| Ok(Value::Duration(ns));
        assert_eq!(converted(Value::Int(2)), ns(2_000_000));
        assert_eq!(converted(Value::Float(2.5)), ns(2_500_000));
        assert_eq!(converted(Value::Text("2.5us".to_owned())), ns(2_500));
        assert!(converted(Value::Float(-1.0)).is_err());
    }
}
