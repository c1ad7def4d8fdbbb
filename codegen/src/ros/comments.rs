//! What stands beside a field: its documentation, and its default as a file can hold it.

use super::names;
use crate::export::plain;
use rc_idsl::Library;
use rc_idsl::model::{Member, Type, TypeDeclKind};
use rc_syntax::{Literal, LiteralKind};

/// The documentation of a field, without its unit.
pub(super) fn of_member(library: &Library, member: &Member) -> Vec<String> {
    let mut doc = member.doc.clone();
    if member.optional {
        doc.push("Optional: none or one.".to_owned());
    }
    let constants = enumeration(library, &member.ty);
    doc.extend(constants.map(|name| format!("An enum: a constant of {name}.")));
    if is_dictionary(library, &member.ty) {
        doc.push("A dictionary: no key twice.".to_owned());
    }
    doc.extend(crate::view::range_text(member).map(|range| format!("Range: {range}.")));
    if let Some(literal) = &member.default
        && default(library, member).is_none()
    {
        doc.push(format!("Default: {}.", plain(literal)));
    }
    doc
}

/// The enum that a field holds values of, or elements of.
fn enumeration(library: &Library, ty: &Type) -> Option<String> {
    match library.resolved(ty) {
        Type::Sequence(element, _) | Type::Array(element, _) => enumeration(library, element),
        Type::Named(id) => match library.ty(*id).kind {
            TypeDeclKind::Enum(_) => Some(names::message(library, *id).to_string()),
            _ => None,
        },
        _ => None,
    }
}

fn is_dictionary(library: &Library, ty: &Type) -> bool {
    matches!(library.resolved(ty), Type::Dictionary(..))
}

/// The default of a field; none where it has none, or ROS 2 cannot hold it.
pub(super) fn default(library: &Library, member: &Member) -> Option<String> {
    let literal = member.default.as_ref().filter(|_| !member.optional)?;
    let value = value(library, library.resolved(&member.ty), literal)?;
    // It would be a constant.
    Some(value).filter(|value| !value.contains('='))
}

/// A value as a file has it; none where `rosidl` does not read it as it was meant.
pub(super) fn value(library: &Library, ty: &Type, literal: &Literal) -> Option<String> {
    let float = matches!(ty, Type::Primitive(primitive) if primitive.is_float());
    match &literal.kind {
        LiteralKind::Int(value) if float => Some(format!("{value}.0")),
        LiteralKind::Int(value) => Some(value.to_string()),
        LiteralKind::Float(value) => Some(format!("{value:?}")),
        LiteralKind::Bool(value) => Some(value.to_string()),
        LiteralKind::String(text) => quoted(text),
        LiteralKind::Name(name) => match ty {
            Type::Named(id) => match &library.ty(*id).kind {
                TypeDeclKind::Enum(values) => {
                    let value = values.iter().find(|value| value.name.text == *name)?;
                    Some(value.value.to_string())
                }
                _ => None,
            },
            _ => None,
        },
        LiteralKind::Duration(_) => None,
    }
}

/// A text in the quotes that are not in it. What begins a comment or an escape is no text for `rosidl`, wherever it is.
fn quoted(text: &str) -> Option<String> {
    if text.contains(|c: char| breaks(c) || c == '\\' || c == '#') {
        return None;
    }
    let quote = ['"', '\'']
        .into_iter()
        .find(|quote| !text.contains(*quote))?;
    Some(format!("{quote}{text}{quote}"))
}

/// A line of documentation, so that neither `rosidl` nor what it generates finds more in it than a comment: a `\` begins
/// an escape, brackets hold a unit, and `*/` ends a comment of C.
pub(crate) fn harmless(text: &str) -> String {
    let text = text.replace("*/", "* /");
    let letters = text.chars().map(|c| match c {
        '\\' => '\u{2216}',
        '[' => '(',
        ']' => ')',
        c if breaks(c) => ' ',
        c => c,
    });
    let text: String = letters.collect();
    text.trim_end().to_owned()
}

/// What ends a line, for some reader at least, or is no part of one.
fn breaks(c: char) -> bool {
    c.is_control() || matches!(c, '\u{2028}' | '\u{2029}')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_stay_comments() {
        assert_eq!(harmless("a[0] \\x */\u{2028}b\t"), "a(0) ∖x * / b");
        assert_eq!(quoted("it's"), Some("\"it's\"".to_owned()));
        assert_eq!(quoted("\"x\""), Some("'\"x\"'".to_owned()));
        for text in ["a\\b", "a#b", "a\nb", "\"'"] {
            assert_eq!(quoted(text), None, "{text}");
        }
    }
}
