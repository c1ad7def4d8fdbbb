//! JSON as the files have it: objects with the order of their members, and numbers as written.

use rc_diagnostics::{Diagnostic, SourceId, SourceMap, Span};
use serde::Deserialize;
use serde::de::{Deserializer, MapAccess, SeqAccess, Visitor};
use std::fmt;
use std::marker::PhantomData;
use std::path::PathBuf;

/// The members of an object, in their order. Names may be duplicate.
#[derive(Clone, Debug)]
pub(crate) struct Members<T>(pub(crate) Vec<(String, T)>);

impl<T> Default for Members<T> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Members<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Reader<T>(PhantomData<T>);
        impl<'de, T: Deserialize<'de>> Visitor<'de> for Reader<T> {
            type Value = Members<T>;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("an object")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
                let mut members = Vec::new();
                while let Some(member) = map.next_entry()? {
                    members.push(member);
                }
                Ok(Members(members))
            }
        }
        deserializer.deserialize_map(Reader(PhantomData))
    }
}

/// Any value.
#[derive(Clone, Debug)]
pub(crate) enum Raw {
    Null,
    Bool(bool),
    Int(i64),
    /// An integer beyond 63 bits.
    Large(u64),
    Float(f64),
    Text(String),
    List(Vec<Raw>),
    Object(Members<Raw>),
}

impl<'de> Deserialize<'de> for Raw {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Reader;
        impl<'de> Visitor<'de> for Reader {
            type Value = Raw;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a value")
            }

            fn visit_unit<E>(self) -> Result<Raw, E> {
                Ok(Raw::Null)
            }

            fn visit_bool<E>(self, value: bool) -> Result<Raw, E> {
                Ok(Raw::Bool(value))
            }

            fn visit_i64<E>(self, value: i64) -> Result<Raw, E> {
                Ok(Raw::Int(value))
            }

            fn visit_u64<E>(self, value: u64) -> Result<Raw, E> {
                Ok(i64::try_from(value).map_or(Raw::Large(value), Raw::Int))
            }

            fn visit_f64<E>(self, value: f64) -> Result<Raw, E> {
                Ok(Raw::Float(value))
            }

            fn visit_str<E>(self, value: &str) -> Result<Raw, E> {
                Ok(Raw::Text(value.to_owned()))
            }

            fn visit_string<E>(self, value: String) -> Result<Raw, E> {
                Ok(Raw::Text(value))
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Raw, A::Error> {
                let mut items = Vec::new();
                while let Some(item) = list.next_element()? {
                    items.push(item);
                }
                Ok(Raw::List(items))
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Raw, A::Error> {
                let mut members = Vec::new();
                while let Some(member) = map.next_entry()? {
                    members.push(member);
                }
                Ok(Raw::Object(Members(members)))
            }
        }
        deserializer.deserialize_any(Reader)
    }
}

impl Raw {
    /// An integer, also as a text, as some files of DSR have it.
    pub(crate) fn integer(&self) -> Option<u64> {
        match self {
            Self::Int(value) => u64::try_from(*value).ok(),
            Self::Large(value) => Some(*value),
            Self::Text(text) => text.parse().ok(),
            _ => None,
        }
    }

    /// The value as messages name it.
    pub(crate) fn described(&self) -> &'static str {
        match self {
            Self::Null => "null",
            Self::Bool(_) => "true or false",
            Self::Int(_) | Self::Large(_) => "an integer",
            Self::Float(_) => "a number",
            Self::Text(_) => "a string",
            Self::List(_) => "an array",
            Self::Object(_) => "an object",
        }
    }
}

/// Adds the text of a file. A byte order mark, which the texts of other languages may have, is an
/// error in JSON.
pub fn add(
    sources: &mut SourceMap,
    path: impl Into<PathBuf>,
    text: String,
) -> (SourceId, Option<Diagnostic>) {
    let has_mark = text.starts_with('\u{feff}');
    let source = sources.add(path, text);
    let error = has_mark.then(|| {
        let message = "the file begins with a byte order mark, which JSON does not allow";
        let diagnostic = Diagnostic::error("malformed-json", Span::new(source, 0, 0), message);
        diagnostic.help("save it as UTF-8 without a mark")
    });
    (source, error)
}

/// Reads a text. An error is at its place, also for text after the end.
pub(crate) fn read<'t, T: Deserialize<'t>>(
    sources: &'t SourceMap,
    source: SourceId,
) -> Result<T, Diagnostic> {
    let text = sources.text(source);
    serde_json::from_str(text).map_err(|error| {
        let at = place(text, error.line(), error.column());
        let message = error.to_string();
        // The place is told by the diagnostic.
        let message = message.split(" at line ").next().unwrap_or_default();
        let message = rc_diagnostics::foreign::clean(&told(message));
        Diagnostic::error("malformed-json", Span::new(source, at, at), message)
    })
}

/// A message of `serde_json` about a value of another type, in the words of [`Raw::described`].
fn told(message: &str) -> String {
    let parts = message.strip_prefix("invalid type: ");
    let Some((found, expected)) = parts.and_then(|rest| rest.rsplit_once(", expected ")) else {
        return message.to_owned();
    };
    let found = match found.split(' ').next().unwrap_or_default() {
        "null" => "null",
        "boolean" => "true or false",
        "integer" => "an integer",
        "floating" => "a number",
        "string" => "a string",
        "sequence" => "an array",
        "map" => "an object",
        _ => found,
    };
    let expected = match expected {
        "a sequence" => "an array",
        "u64" => "an integer",
        other if other.starts_with("struct ") => "an object",
        other => other,
    };
    format!("expected {expected}, found {found}")
}

/// The first integer of a valid text that has more than 64 bits, which would become a float.
pub(crate) fn wide_integer(text: &str) -> Option<(usize, usize)> {
    let bytes = text.as_bytes();
    let mut at = 0;
    while let Some(byte) = bytes.get(at) {
        let start = at;
        at += 1;
        match byte {
            b'"' => {
                while let Some(inside) = bytes.get(at).filter(|inside| **inside != b'"') {
                    at += if *inside == b'\\' { 2 } else { 1 };
                }
                at += 1;
            }
            b'-' | b'0'..=b'9' => {
                let is_number =
                    |byte: &&u8| matches!(byte, b'0'..=b'9' | b'.' | b'e' | b'E' | b'+' | b'-');
                at += bytes[at..].iter().take_while(is_number).count();
                let number = &text[start..at];
                let is_integer = !number.contains(['.', 'e', 'E']);
                if is_integer && number.parse::<i64>().is_err() && number.parse::<u64>().is_err() {
                    return Some((start, at));
                }
            }
            _ => {}
        }
    }
    None
}

/// The byte at a line and a column of `serde_json`, both from 1.
fn place(text: &str, line: usize, column: usize) -> usize {
    let start = match line {
        0 | 1 => 0,
        _ => {
            let ends = text.bytes().enumerate().filter(|(_, byte)| *byte == b'\n');
            ends.map(|(at, _)| at + 1)
                .nth(line - 2)
                .unwrap_or(text.len())
        }
    };
    let mut at = (start + column.saturating_sub(1)).min(text.len());
    while !text.is_char_boundary(at) {
        at -= 1;
    }
    at
}

/// A text as JSON.
pub(crate) fn quoted(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}

/// A number as JSON: with a point or an exponent, so that it stays a float.
pub(crate) fn float(value: f64) -> String {
    format!("{value:?}")
}
