//! Values of attributes.

use std::borrow::Cow;
use std::sync::Arc;

/// How many bytes one value of bytes has at most.
pub const MOST_BYTES: usize = 64 * 1024;

/// The value of an attribute. A clone copies no content.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// Yes or no.
    Bool(bool),
    /// An integer of 64 bits.
    Int(i64),
    /// A number that is finite.
    Float(f64),
    /// A text.
    Text(Arc<str>),
    /// Bytes, [`MOST_BYTES`] at most.
    Bytes(Arc<[u8]>),
    /// Integers.
    Ints(Arc<[i64]>),
    /// Numbers that are finite.
    Floats(Arc<[f64]>),
    /// Texts.
    Texts(Arc<[Arc<str>]>),
    /// A value that is too large for a graph: a sample of a topic.
    Sample(Arc<Sample>),
}

/// A reference to a sample of a topic.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Sample {
    /// Name of the topic.
    pub topic: String,
    /// Type of its samples: `Module::Name`.
    pub kind: String,
    /// Number of the sample among those of its sender.
    pub sequence: u64,
}

impl Value {
    /// The type as messages name it.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Bool(_) => "bool",
            Self::Int(_) => "int",
            Self::Float(_) => "float",
            Self::Text(_) => "string",
            Self::Bytes(_) => "bytes",
            Self::Ints(_) => "int[]",
            Self::Floats(_) => "float[]",
            Self::Texts(_) => "string[]",
            Self::Sample(_) => "topic",
        }
    }

    /// The number of an integer or a float.
    pub fn as_f64(&self) -> Option<f64> {
        match self {
            Self::Int(value) => Some(*value as f64),
            Self::Float(value) => Some(*value),
            _ => None,
        }
    }

    /// The integer.
    pub fn as_i64(&self) -> Option<i64> {
        match self {
            Self::Int(value) => Some(*value),
            _ => None,
        }
    }

    /// The text.
    pub fn as_str(&self) -> Option<&str> {
        match self {
            Self::Text(text) => Some(text),
            _ => None,
        }
    }

    /// The number at a place of an array.
    pub fn number(&self, at: usize) -> Option<f64> {
        match self {
            Self::Floats(all) => all.get(at).copied(),
            Self::Ints(all) => all.get(at).map(|value| *value as f64),
            _ => None,
        }
    }

    /// All numbers of an array.
    pub fn numbers(&self) -> Option<Cow<'_, [f64]>> {
        match self {
            Self::Floats(all) => Some(Cow::Borrowed(all)),
            Self::Ints(all) => Some(all.iter().map(|value| *value as f64).collect()),
            _ => None,
        }
    }

    /// Whether every number is finite.
    pub fn is_finite(&self) -> bool {
        match self {
            Self::Float(value) => value.is_finite(),
            Self::Floats(all) => all.iter().all(|value| value.is_finite()),
            _ => true,
        }
    }

    /// How much memory the content takes, in bytes.
    pub fn size(&self) -> usize {
        match self {
            Self::Bool(_) | Self::Int(_) | Self::Float(_) => 8,
            Self::Text(text) => text.len(),
            Self::Bytes(bytes) => bytes.len(),
            Self::Ints(all) => all.len() * 8,
            Self::Floats(all) => all.len() * 8,
            Self::Texts(all) => all.iter().map(|text| text.len() + 16).sum(),
            Self::Sample(sample) => sample.topic.len() + sample.kind.len() + 8,
        }
    }
}

impl From<bool> for Value {
    fn from(value: bool) -> Self {
        Self::Bool(value)
    }
}

impl From<i64> for Value {
    fn from(value: i64) -> Self {
        Self::Int(value)
    }
}

impl From<f64> for Value {
    fn from(value: f64) -> Self {
        Self::Float(value)
    }
}

impl From<&str> for Value {
    fn from(value: &str) -> Self {
        Self::Text(value.into())
    }
}

impl From<String> for Value {
    fn from(value: String) -> Self {
        Self::Text(value.into())
    }
}

impl From<&[f64]> for Value {
    fn from(value: &[f64]) -> Self {
        Self::Floats(value.into())
    }
}

impl<const N: usize> From<[f64; N]> for Value {
    fn from(value: [f64; N]) -> Self {
        Self::Floats(value.as_slice().into())
    }
}

impl From<Sample> for Value {
    fn from(value: Sample) -> Self {
        Self::Sample(value.into())
    }
}

impl From<&[u8]> for Value {
    fn from(value: &[u8]) -> Self {
        Self::Bytes(value.into())
    }
}
