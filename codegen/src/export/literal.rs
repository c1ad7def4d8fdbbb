//! Literals as texts.

use rc_syntax::{Literal, LiteralKind};

/// A value for documentation.
pub(crate) fn plain(literal: &Literal) -> String {
    match &literal.kind {
        LiteralKind::Int(value) => value.to_string(),
        LiteralKind::Float(value) => format!("{value:?}"),
        LiteralKind::String(value) => quoted(value),
        LiteralKind::Bool(value) => value.to_string(),
        LiteralKind::Duration(value) => value.to_string(),
        LiteralKind::Name(value) => value.clone(),
    }
}

/// A quoted string with the escapes of OMG IDL.
pub(super) fn quoted(text: &str) -> String {
    let mut out = "\"".to_owned();
    for c in text.chars() {
        match c {
            '"' | '\\' => out.extend(['\\', c]),
            '\n' => out.push_str("\\n"),
            '\t' => out.push_str("\\t"),
            '\r' => out.push_str("\\r"),
            c if c.is_ascii_control() => out.push_str(&format!("\\{:03o}", u32::from(c))),
            c => out.push(c),
        }
    }
    out + "\""
}
