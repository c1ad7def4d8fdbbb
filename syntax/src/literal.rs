//! Literals.

use rc_diagnostics::Span;
use rc_vocabulary::{Number, duration};

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
    /// A number without fraction or exponent, as far as 128 bits hold it.
    Int(i128),
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
    pub fn number(&self) -> Option<Number> {
        match self.kind {
            LiteralKind::Int(value) => Some(Number::Int(value)),
            LiteralKind::Float(value) => Some(Number::Float(value)),
            LiteralKind::String(_)
            | LiteralKind::Bool(_)
            | LiteralKind::Duration(_)
            | LiteralKind::Name(_) => None,
        }
    }

    /// The value of a number, rounded.
    pub fn as_f64(&self) -> Option<f64> {
        self.number().map(Number::as_float)
    }

    /// The value of an integer of 64 bits.
    pub fn as_i64(&self) -> Option<i64> {
        match self.kind {
            LiteralKind::Int(value) => i64::try_from(value).ok(),
            _ => None,
        }
    }

    /// The value of a duration in nanoseconds. A number without a unit is in milliseconds.
    pub fn as_nanoseconds(&self) -> Option<u64> {
        match self.kind {
            LiteralKind::Duration(value) => Some(value),
            LiteralKind::Int(value) => duration::from_milliseconds(i64::try_from(value).ok()?),
            LiteralKind::Float(value) => duration::from_fractional_milliseconds(value),
            _ => None,
        }
    }

    /// The literal as messages name it: `the number 5`, `a duration`.
    pub fn described(&self) -> String {
        match &self.kind {
            LiteralKind::Int(value) => format!("the number {value}"),
            LiteralKind::Float(value) if value.is_infinite() => {
                "a number that is too large".to_owned()
            }
            // With all their digits, such numbers are not read.
            LiteralKind::Float(value) if value.abs() >= 1e16 => format!("the number {value:e}"),
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
        && let Ok(value) = i128::from_str_radix(digits, 16)
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

/// The content of a quoted string, with its escapes replaced. An unknown escape, which is an
/// error elsewhere, stays as it is.
pub fn unescape(quoted: &str) -> String {
    let inner = quoted.strip_prefix('"').unwrap_or(quoted);
    let inner = inner.strip_suffix('"').unwrap_or(inner);
    let mut out = String::with_capacity(inner.len());
    let mut rest = inner;
    while let Some(at) = rest.find('\\') {
        out.push_str(&rest[..at]);
        let (replaced, length) = match escape(&rest[at..]) {
            Escape::Character(c, length) => (Some(c), length),
            Escape::Unknown(length) => (None, length),
        };
        match replaced {
            Some(c) => out.push(c),
            None => out.push_str(&rest[at..at + length]),
        }
        rest = &rest[at + length..];
    }
    out.push_str(rest);
    out
}

/// An escape, and its length in bytes.
pub(crate) enum Escape {
    Character(char, usize),
    Unknown(usize),
}

/// The escape at the start of `text`, which begins with a backslash.
pub(crate) fn escape(text: &str) -> Escape {
    let Some(second) = text.chars().nth(1) else {
        return Escape::Unknown(1);
    };
    Escape::Character(
        match second {
            'n' => '\n',
            'r' => '\r',
            't' => '\t',
            '"' | '\\' => second,
            'u' => {
                let point = text[2..].strip_prefix('{');
                let digits = point.and_then(|rest| rest.split_once('}')).map(|(d, _)| d);
                let valid = digits.filter(|d| d.len() <= 6 && !d.starts_with('+'));
                let number = valid.and_then(|d| u32::from_str_radix(d, 16).ok());
                let Some(c) = number.and_then(char::from_u32) else {
                    return Escape::Unknown(2);
                };
                return Escape::Character(c, 4 + digits.map_or(0, str::len));
            }
            '\n' | '\r' => return Escape::Unknown(1),
            other => return Escape::Unknown(1 + other.len_utf8()),
        },
        2,
    )
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
        assert_eq!(
            parse_kind("18446744073709551615"),
            LiteralKind::Int(i128::from(u64::MAX))
        );
        assert_eq!(
            parse_kind("-0x8000000000000000"),
            LiteralKind::Int(i128::from(i64::MIN))
        );
        assert_eq!(
            parse_kind(r#""\d\.\r\u{e9}\u{1F600}\q""#),
            LiteralKind::String("\\d\\.\ré😀\\q".to_owned())
        );
        assert_eq!(parse_kind("1.5 s"), LiteralKind::Duration(1_500_000_000));
        assert_eq!(
            parse_kind("best_effort"),
            LiteralKind::Name("best_effort".to_owned())
        );
    }
}
