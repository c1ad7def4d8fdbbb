//! The parameters of a component, resolved: what generated code embeds, and what a configuration is read by.

use crate::condition::Condition;
use rc_diagnostics::nearest;
use rc_settings::duration;
use serde::{Deserialize, Serialize};
use std::fmt::Write;
use std::time::Duration;

/// All parameters of a component.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Parameters {
    /// The name after `ComponentParams`.
    pub name: String,
    /// Its documentation.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub doc: Vec<String>,
    /// The parameters in the order of the text.
    pub parameters: Vec<Parameter>,
    /// The rules across parameters.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub rules: Vec<Rule>,
}

impl Parameters {
    /// Whether the value of any of them is never shown.
    pub fn has_secrets(&self) -> bool {
        self.parameters.iter().any(Parameter::has_secrets)
    }

    /// One line of JSON that [`Parameters::from_json`] reads.
    pub fn to_json(&self) -> String {
        // Only maps with keys that are no texts cannot be written, and there are none.
        serde_json::to_string(self).unwrap_or_default()
    }

    /// Reads what [`Parameters::to_json`] wrote.
    pub fn from_json(text: &str) -> Result<Self, serde_json::Error> {
        serde_json::from_str(text)
    }
}

/// A `require` rule.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rule {
    /// The names of the groups and lists in which it stands, from outside; in a list it holds for each element.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub scope: Vec<String>,
    /// What has to hold.
    pub condition: Condition,
    /// The condition as written, for people.
    pub text: String,
    /// What is said where it is broken.
    pub message: String,
}

/// One parameter, group or list.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Parameter {
    /// Its name.
    pub name: String,
    /// Its documentation, line by line.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub doc: Vec<String>,
    /// What it is.
    pub kind: Kind,
    /// Its value where a configuration has none; without it, a scalar or an array is required.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub default: Option<Value>,
    /// The allowed values of a number or a duration, or of each element of an array of them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub range: Option<Range>,
    /// The only allowed values, or elements; empty where there is no such limit.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub choices: Vec<Value>,
    /// Its unit, for people.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    /// `T`: it may be changed while the component runs.
    #[serde(default, skip_serializing_if = "is_false")]
    pub editable: bool,
    /// A change is accepted and takes effect at the next start.
    #[serde(default, skip_serializing_if = "is_false")]
    pub restart: bool,
    /// Its value is never shown.
    #[serde(default, skip_serializing_if = "is_false")]
    pub secret: bool,
}

#[expect(
    clippy::trivially_copy_pass_by_ref,
    reason = "serde calls it with a reference"
)]
fn is_false(value: &bool) -> bool {
    !*value
}

/// What a parameter is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// One value, or an array of values.
    Scalar {
        /// The type of the value, or of each element.
        #[serde(rename = "type")]
        ty: Type,
        /// The allowed length, where it is an array.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        array: Option<Length>,
    },
    /// Parameters that belong together.
    Group(Vec<Parameter>),
    /// A list of structures.
    List {
        /// Its allowed length.
        length: Length,
        /// The parameters of each element.
        parameters: Vec<Parameter>,
    },
}

/// How many elements there may be.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Length {
    /// At least.
    pub min: u32,
    /// At most; any number where there is none.
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

/// The types of values.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Type {
    /// `true` or `false`
    Bool,
    /// A whole number of 32 bits.
    Int,
    /// A whole number of 64 bits.
    Long,
    /// A floating-point number of 32 bits.
    Float,
    /// A floating-point number of 64 bits.
    Double,
    /// A text.
    String,
    /// A time.
    Duration,
    /// A path in the file system.
    Path,
}

/// Why a value is not one of a type.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ConversionError {
    /// It has another type.
    WrongType,
    /// It is a number that the type cannot hold.
    OutOfRange,
}

impl Type {
    /// All types, by the words that name them.
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

    /// The type that `word` names, in upper or lower case.
    pub fn from_word(word: &str) -> Option<Self> {
        Self::WORDS
            .iter()
            .find(|(w, _)| w.eq_ignore_ascii_case(word))
            .map(|(_, ty)| *ty)
    }

    /// The word that names it.
    pub fn word(self) -> &'static str {
        Self::WORDS
            .iter()
            .find(|(_, ty)| *ty == self)
            .map_or("", |(word, _)| word)
    }

    /// Whether its values are numbers, which may have a unit.
    pub fn is_number(self) -> bool {
        matches!(self, Self::Int | Self::Long | Self::Float | Self::Double)
    }

    /// Whether its values have an order that a range can limit.
    pub fn is_ordered(self) -> bool {
        self.is_number() || self == Self::Duration
    }

    /// What its values are, for messages.
    pub fn described(self) -> &'static str {
        match self {
            Self::Bool => "`true` or `false`",
            Self::Int => "a whole number of 32 bits",
            Self::Long => "a whole number of 64 bits",
            Self::Float => "a number of 32 bits",
            Self::Double => "a number of 64 bits",
            Self::String => "a text in quotes",
            Self::Duration => "a time like \"50ms\", or a number of milliseconds",
            Self::Path => "a path in quotes",
        }
    }

    /// `value` as a value of this type: whole numbers are numbers, a time may be a text or a number of
    /// milliseconds.
    pub fn convert(self, value: &Value) -> Result<Value, ConversionError> {
        Ok(match (self, value) {
            // A time that is too long was read as the longest.
            (Self::Duration, Value::Duration(u64::MAX)) => return Err(ConversionError::OutOfRange),
            // An infinity that was written as such is kept; one that comes of rounding is a number too large.
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

/// One value. What is no number (`nan`) equals itself: two values are equal where a file that says one of them need not
/// be changed to say the other one.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Value {
    /// `true` or `false`
    Bool(bool),
    /// A whole number.
    Int(i64),
    /// Any other number.
    Float(f64),
    /// A text or a path.
    Text(String),
    /// A time in nanoseconds.
    Duration(u64),
    /// The elements of an array.
    Array(Vec<Value>),
}

impl PartialEq for Value {
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Float(a), Self::Float(b)) => a == b || (a.is_nan() && b.is_nan()),
            (Self::Bool(a), Self::Bool(b)) => a == b,
            (Self::Int(a), Self::Int(b)) => a == b,
            (Self::Text(a), Self::Text(b)) => a == b,
            (Self::Duration(a), Self::Duration(b)) => a == b,
            (Self::Array(a), Self::Array(b)) => a == b,
            _ => false,
        }
    }
}

impl Value {
    /// The text, if it is one.
    pub fn as_text(&self) -> Option<&str> {
        match self {
            Self::Text(text) => Some(text),
            _ => None,
        }
    }

    /// `true` or `false`, if it is one of them.
    pub fn as_bool(&self) -> Option<bool> {
        match self {
            Self::Bool(value) => Some(*value),
            _ => None,
        }
    }

    /// The whole number, if it is one: the value of an `int` or a `long`.
    pub fn as_int(&self) -> Option<i64> {
        match self {
            Self::Int(value) => Some(*value),
            _ => None,
        }
    }

    /// The number, if it is one: the value of a `float` or a `double`.
    pub fn as_float(&self) -> Option<f64> {
        match self {
            Self::Float(value) => Some(*value),
            _ => None,
        }
    }

    /// The time, if it is one.
    pub fn as_duration(&self) -> Option<Duration> {
        match self {
            Self::Duration(value) => Some(Duration::from_nanos(*value)),
            _ => None,
        }
    }

    /// The elements, if it is an array.
    pub fn as_array(&self) -> Option<&[Self]> {
        match self {
            Self::Array(values) => Some(values),
            _ => None,
        }
    }

    /// As JSON: a time as a text like `50ms`; what JSON has no number for as TOML writes it, `inf`, `nan`.
    pub fn to_json(&self) -> serde_json::Value {
        match self {
            Self::Bool(value) => (*value).into(),
            Self::Int(value) => (*value).into(),
            Self::Float(value) if value.is_finite() => (*value).into(),
            Self::Float(_) => self.to_toml().into(),
            Self::Text(value) => value.as_str().into(),
            Self::Duration(value) => duration::text(*value).into(),
            Self::Array(values) => values.iter().map(Self::to_json).collect(),
        }
    }

    /// As it is written in a TOML file, on one line.
    pub fn to_toml(&self) -> String {
        match self {
            Self::Bool(value) => value.to_string(),
            Self::Int(value) => value.to_string(),
            Self::Float(value) if value.is_nan() => "nan".to_owned(),
            Self::Float(value) => format!("{value:?}"),
            Self::Text(value) => quoted(value),
            Self::Duration(value) => quoted(&duration::text(*value)),
            Self::Array(values) => {
                let values: Vec<String> = values.iter().map(Self::to_toml).collect();
                format!("[{}]", values.join(", "))
            }
        }
    }
}

/// A TOML text. Rust's own notation differs in the escapes of control characters.
fn quoted(text: &str) -> String {
    let mut out = String::from("\"");
    for c in text.chars() {
        match c {
            '"' => out.push_str("\\\""),
            '\\' => out.push_str("\\\\"),
            '\n' => out.push_str("\\n"),
            '\t' => out.push_str("\\t"),
            c if c.is_control() => {
                let _ = write!(out, "\\u{:04X}", u32::from(c));
            }
            c => out.push(c),
        }
    }
    out.push('"');
    out
}

/// The limits of a value, both included. They are of the parameter's own type, so that integers stay exact.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Range {
    /// The smallest value.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub min: Option<Value>,
    /// The largest value.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub max: Option<Value>,
}

impl Range {
    /// Whether `value` is within; a value that is no number at all (NaN) is in no range.
    pub fn contains(&self, value: &Value) -> bool {
        self.min.as_ref().is_none_or(|min| at_most(min, value))
            && self.max.as_ref().is_none_or(|max| at_most(value, max))
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
    /// A required parameter of this kind without any limits.
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
        }
    }

    /// The allowed values in words: "a whole number of 32 bits, from 0 to 127".
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

    /// The allowed values of a scalar or of each element of an array, and the choice that `value` probably meant.
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

    /// Its type and its limits in the words of PDSL: "int, from 0 to 127".
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

    /// When a change takes effect, for people; nothing where it is fixed at the start.
    pub fn change(&self) -> Option<&'static str> {
        match (self.restart, self.editable) {
            (true, _) => Some("a change takes effect at the next start"),
            (false, true) => Some("may be changed while the component runs"),
            (false, false) => None,
        }
    }

    /// Whether a configuration has to say something about it.
    pub fn is_required(&self) -> bool {
        match &self.kind {
            Kind::Scalar { .. } => self.default.is_none(),
            Kind::Group(members) => members.iter().any(Self::is_required),
            Kind::List { length, .. } => length.min > 0,
        }
    }

    /// Whether its value, or any in it, is never shown.
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
