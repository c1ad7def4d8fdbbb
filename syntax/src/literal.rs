//! Literals.

use rc_diagnostics::Span;
use rc_vocabulary::duration;

/// A literal with its location.
#[derive(Clone, Debug, PartialEq)]
pub struct Literal {
    /// The value.
    pub kind: LiteralKind,
    /// The location.
    pub span: Span,
}

/// The value of a literal.
#[derive(Clone, Debug, PartialEq)]
pub enum LiteralKind {
    /// A number without fraction or exponent.
    Int(i64),
    /// Any other number.
    Float(f64),
    /// A quoted string, unescaped.
    String(String),
    /// `true` or `false`.
    Bool(bool),
    /// A number with a unit of time, converted to nanoseconds.
    Duration(u64),
    /// Any other word, for example an enumerator.
    Name(String),
}

impl Literal {
    /// Parses the text that the grammar rule `literal` matched.
    pub fn parse(text: &str, span: Span) -> Self {
        Self {
            kind: parse_kind(text.trim()),
            span,
        }
    }

    /// The value of a number.
    pub fn as_f64(&self) -> Option<f64> {
        match self.kind {
            LiteralKind::Int(value) => Some(value as f64),
            LiteralKind::Float(value) => Some(value),
            _ => None,
        }
    }

    /// The value of an integer.
    pub fn as_i64(&self) -> Option<i64> {
        match self.kind {
            LiteralKind::Int(value) => Some(value),
            _ => None,
        }
    }

    /// The value of a duration in nanoseconds. A number without a unit is in milliseconds.
    pub fn as_nanoseconds(&self) -> Option<u64> {
        match self.kind {
            LiteralKind::Duration(value) => Some(value),
            LiteralKind::Int(value) => duration::from_milliseconds(value),
            LiteralKind::Float(value) => duration::from_fractional_milliseconds(value),
            _ => None,
        }
    }

    /// The literal as messages name it: `the number 5`, `a duration`.
    pub fn described(&self) -> String {
        match &self.kind {
            LiteralKind::Int(value) => format!("the number {value}"),
            LiteralKind::Float(value) => format!("the number {value}"),
            LiteralKind::String(value) => format!("the string \"{value}\""),
            LiteralKind::Bool(value) => format!("`{value}`"),
            LiteralKind::Duration(_) => "a duration".to_owned(),
            LiteralKind::Name(value) => format!("`{value}`"),
        }
    }
}

fn parse_kind(text: &str) -> LiteralKind {
    if text.starts_with('"') {
        return LiteralKind::String(unescape(text));
    }
    match text {
        "true" => return LiteralKind::Bool(true),
        "false" => return LiteralKind::Bool(false),
        _ => {}
    }
    let hex = text.strip_prefix("0x").map(|digits| (digits, false));
    let hex = hex.or_else(|| text.strip_prefix("-0x").map(|digits| (digits, true)));
    if let Some((digits, negative)) = hex
        && let Ok(value) = i64::from_str_radix(digits, 16)
    {
        return LiteralKind::Int(if negative { -value } else { value });
    }
    if let Ok(value) = text.parse() {
        return LiteralKind::Int(value);
    }
    if text.starts_with(|c: char| c.is_ascii_digit() || c == '-') {
        if let Ok(value) = text.parse() {
            return LiteralKind::Float(value);
        }
        if let Some(value) = duration::parse(text) {
            return LiteralKind::Duration(value);
        }
    }
    LiteralKind::Name(text.to_owned())
}

/// The content of a quoted string, with the escapes `\n`, `\t`, `\"` and `\\` replaced.
pub fn unescape(quoted: &str) -> String {
    let inner = quoted.strip_prefix('"').unwrap_or(quoted);
    let inner = inner.strip_suffix('"').unwrap_or(inner);
    let mut out = String::with_capacity(inner.len());
    let mut chars = inner.chars();
    while let Some(c) = chars.next() {
        match (c, if c == '\\' { chars.next() } else { None }) {
            ('\\', Some('n')) => out.push('\n'),
            ('\\', Some('t')) => out.push('\t'),
            ('\\', Some(other)) | (other, _) => out.push(other),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn literals_are_what_they_look_like() {
        assert_eq!(parse_kind("-12"), LiteralKind::Int(-12));
        assert_eq!(parse_kind("0x1F"), LiteralKind::Int(31));
        assert_eq!(parse_kind("1e3"), LiteralKind::Float(1000.0));
        assert_eq!(
            parse_kind("\"a\\\"b\""),
            LiteralKind::String("a\"b".to_owned())
        );
        assert_eq!(parse_kind("1.5 s"), LiteralKind::Duration(1_500_000_000));
        assert_eq!(
            parse_kind("best_effort"),
            LiteralKind::Name("best_effort".to_owned())
        );
    }
}
