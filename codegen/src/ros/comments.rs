//! The comments and default values of fields in files of ROS 2.

use super::names;
use crate::export::literal::plain;
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
    doc.extend(crate::view::checks::range_text(member).map(|range| format!("Range: {range}.")));
    if let Some(literal) = &member.default
        && default(library, member).is_none()
    {
        doc.push(format!("Default: {}.", plain(literal)));
    }
    doc
}

/// The enum of a field or of its elements.
fn enumeration(library: &Library, ty: &Type) -> Option<String> {
    match library.resolved(ty) {
        Type::Sequence { element, .. } | Type::Array { element, .. } => {
            enumeration(library, element)
        }
        Type::Named(id) => match library.ty(*id).kind {
            TypeDeclKind::Enum(_) => Some(names::message(library, *id).to_string()),
            TypeDeclKind::Struct(_) | TypeDeclKind::Exception(_) | TypeDeclKind::Alias(_) => None,
        },
        Type::Primitive(_) | Type::Text { .. } | Type::Dictionary { .. } => None,
    }
}

fn is_dictionary(library: &Library, ty: &Type) -> bool {
    matches!(library.resolved(ty), Type::Dictionary { .. })
}

/// The default value of a field. `None` if it has none, or if ROS 2 cannot express it.
pub(super) fn default(library: &Library, member: &Member) -> Option<String> {
    let literal = member.default.as_ref().filter(|_| !member.optional)?;
    let value = value(library, library.resolved(&member.ty), literal)?;
    // With `=` the line would declare a constant.
    Some(value).filter(|value| !value.contains('='))
}

/// A value as written in a file. `None` if `rosidl` would read it differently.
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
                TypeDeclKind::Struct(_) | TypeDeclKind::Exception(_) | TypeDeclKind::Alias(_) => {
                    None
                }
            },
            Type::Primitive(_)
            | Type::Text { .. }
            | Type::Sequence { .. }
            | Type::Array { .. }
            | Type::Dictionary { .. } => None,
        },
        LiteralKind::Duration(_) => None,
    }
}

/// A string in quotes that do not occur in it. `None` if `rosidl` would find a comment or an
/// escape.
fn quoted(text: &str) -> Option<String> {
    if text.contains(|c: char| breaks_line(c) || c == '\\' || c == '#') {
        return None;
    }
    let quote = ['"', '\'']
        .into_iter()
        .find(|quote| !text.contains(*quote))?;
    Some(format!("{quote}{text}{quote}"))
}

/// Sanitizes a line of documentation. `rosidl` and its generated code would interpret some
/// characters: `\` begins an escape, brackets contain a unit, and `*/` ends a comment in C.
pub(crate) fn sanitized(text: &str) -> String {
    let text = text.replace("*/", "* /");
    let letters = text.chars().map(|c| match c {
        '\\' => '\u{2216}',
        '[' => '(',
        ']' => ')',
        c if breaks_line(c) => ' ',
        c => c,
    });
    let text: String = letters.collect();
    text.trim_end().to_owned()
}

/// Whether some tools treat the character as the end of a line, or as no character.
fn breaks_line(c: char) -> bool {
    c.is_control() || matches!(c, '\u{2028}' | '\u{2029}')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_stay_comments() {
        assert_eq!(sanitized("a[0] \\x */\u{2028}b\t"), "a(0) ∖x * / b");
        assert_eq!(quoted("it's"), Some("\"it's\"".to_owned()));
        assert_eq!(quoted("\"x\""), Some("'\"x\"'".to_owned()));
        for text in ["a\\b", "a#b", "a\nb", "\"'"] {
            assert_eq!(quoted(text), None, "{text}");
        }
    }
}
