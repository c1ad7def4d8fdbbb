//! Types of C++.

use super::names;
use crate::view::members::{Member, Value};
use crate::view::types::{Declared, Named, Type, resolved};
use rc_vocabulary::Primitive;

/// A number or a `bool`.
pub(super) fn primitive(primitive: Primitive) -> String {
    let c = primitive.c();
    let space = if c.ends_with("_t") { "std::" } else { "" };
    format!("{space}{c}")
}

/// The type of a value.
pub(super) fn of(ty: &Type) -> String {
    match ty {
        Type::Primitive(name) => primitive(*name),
        Type::Text { .. } => "std::string".to_owned(),
        Type::Sequence { element, .. } => format!("std::vector<{}>", of(element)),
        Type::Array { element, length } => format!("std::array<{}, {length}>", of(element)),
        Type::Dictionary { key, value } => format!("std::map<{}, {}>", of(key), of(value)),
        Type::Named(Named { module, name, .. }) => {
            format!("{}::{}", names::own(module), names::own(name))
        }
    }
}

/// The type of a member or a parameter.
pub(super) fn of_member(member: &Member) -> String {
    if member.optional {
        format!("std::optional<{}>", of(&member.ty))
    } else {
        of(&member.ty)
    }
}

/// The type of a parameter that goes in: numbers and enums by value, everything else by reference.
pub(super) fn input(member: &Member) -> String {
    let ty = of_member(member);
    let by_value = match resolved(&member.ty) {
        Type::Primitive(_) => true,
        Type::Named(Named { of, .. }) => *of == Declared::Enum,
        Type::Text { .. }
        | Type::Sequence { .. }
        | Type::Array { .. }
        | Type::Dictionary { .. } => false,
    };
    if by_value && !member.optional {
        ty
    } else {
        format!("const {ty}&")
    }
}

/// The type of a value in place, whose size its type determines. `placed` names the structure of a
/// named one.
pub(super) fn in_place(ty: &Type, placed: &dyn Fn(&Named) -> String) -> String {
    match resolved(ty) {
        Type::Primitive(Primitive::Bool) => "rc::Flag".to_owned(),
        Type::Primitive(name) => primitive(*name),
        Type::Text { bound } => format!("rc::Text<{}>", bound.unwrap_or_default()),
        Type::Sequence { element, bound } => {
            let element = in_place(element, placed);
            format!("rc::Bounded<{element}, {}>", bound.unwrap_or_default())
        }
        Type::Array { element, length } => {
            format!("std::array<{}, {length}>", in_place(element, placed))
        }
        ty @ Type::Named(named) => match named.of {
            Declared::Enum => of(ty),
            Declared::Struct | Declared::Exception | Declared::Alias => placed(named),
        },
        // A dictionary has no image, so it does not occur here.
        ty @ Type::Dictionary { .. } => of(ty),
    }
}

/// A text in quotes.
pub(super) fn text(text: &str) -> String {
    let mut out = String::from("\"");
    for c in text.chars() {
        match c {
            '"' => out.push_str("\\\""),
            '\\' => out.push_str("\\\\"),
            '\n' => out.push_str("\\n"),
            '\t' => out.push_str("\\t"),
            // Three octal digits end, whatever follows; and no trigraph begins.
            c if c.is_ascii_control() => out.push_str(&format!("\\{:03o}", u32::from(c))),
            '?' => out.push_str("\\?"),
            c => out.push(c),
        }
    }
    out.push('"');
    out
}

/// The expression of a value of the IDSL.
pub(super) fn value(value: &Value) -> String {
    match resolved(&value.ty) {
        Type::Primitive(name) => number(*name, &value.text),
        Type::Named(Named { module, name, .. }) => format!(
            "{}::{}::{}",
            names::own(module),
            names::own(name),
            names::own(&value.text)
        ),
        Type::Text { .. }
        | Type::Sequence { .. }
        | Type::Array { .. }
        | Type::Dictionary { .. } => text(&value.text),
    }
}

fn number(primitive: Primitive, text: &str) -> String {
    match primitive {
        Primitive::F32 => format!("{text}f"),
        // The literal without its sign is one more than the largest value.
        Primitive::I64 if text == "-9223372036854775808" => "INT64_MIN".to_owned(),
        Primitive::I32 if text == "-2147483648" => "INT32_MIN".to_owned(),
        Primitive::I64 => format!("INT64_C({text})"),
        Primitive::U64 => format!("UINT64_C({text})"),
        Primitive::U32 => format!("{text}u"),
        Primitive::Bool
        | Primitive::I8
        | Primitive::U8
        | Primitive::I16
        | Primitive::U16
        | Primitive::I32
        | Primitive::F64 => text.to_owned(),
    }
}
