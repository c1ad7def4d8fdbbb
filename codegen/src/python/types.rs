//! Types and values as Python writes them.

use super::names;
use crate::view::members::{Member, Value};
use crate::view::types::{Declared, Named, Type, resolved};
use rc_vocabulary::{Class, Primitive};

/// The path of a named type, from its module and its name in the IDSL.
pub(crate) type Path<'a> = &'a dyn Fn(&str, &str) -> String;

/// An annotation, with aliases resolved. Numbers in a row are an array of `NumPy`.
pub(crate) fn annotation(ty: &Type, path: Path) -> String {
    match resolved(ty) {
        Type::Primitive(name) => primitive(*name).0.to_owned(),
        Type::Text { .. } => "str".to_owned(),
        Type::Sequence { element, .. } | Type::Array { element, .. } => match dtype(element) {
            Some(dtype) => format!("_npt.NDArray[_np.{dtype}]"),
            None => format!("list[{}]", annotation(element, path)),
        },
        Type::Dictionary { key, value } => {
            format!(
                "dict[{}, {}]",
                annotation(key, path),
                annotation(value, path)
            )
        }
        Type::Named(Named { module, name, .. }) => path(module, name),
    }
}

/// The annotation of a member, which may be optional.
pub(crate) fn member(member: &Member, path: Path) -> String {
    let ty = annotation(&member.ty, path);
    if member.optional {
        format!("{ty} | None")
    } else {
        ty
    }
}

/// The type of Python for a number, and its zero.
pub(crate) fn primitive(of: Primitive) -> (&'static str, &'static str) {
    match of.class() {
        Class::Bool => ("bool", "False"),
        Class::Signed | Class::Unsigned => ("int", "0"),
        Class::Float => ("float", "0.0"),
    }
}

/// The type of `NumPy` for a number.
pub(crate) fn dtype(ty: &Type) -> Option<&'static str> {
    let Type::Primitive(name) = resolved(ty) else {
        return None;
    };
    Some(match name.class() {
        Class::Bool => "bool_",
        Class::Signed | Class::Unsigned | Class::Float => name.plain().word(),
    })
}

/// The default value of a member, as an expression; a mutable one is made by a function.
pub(crate) enum Default {
    /// An expression.
    Value(String),
    /// An expression that makes a new value each time.
    New(String),
}

/// The initial value of a member. `first` names the first enumerator of an enum.
pub(crate) fn default(
    member: &Member,
    path: Path,
    first: &dyn Fn(&str, &str) -> String,
) -> Default {
    if let Some(value) = &member.default {
        return Default::Value(self::value(value, path));
    }
    if member.optional {
        return Default::Value("None".to_owned());
    }
    of_type(&member.ty, path, first)
}

/// The default value of a type.
pub(crate) fn of_type(ty: &Type, path: Path, first: &dyn Fn(&str, &str) -> String) -> Default {
    let value = |text: &str| Default::Value(text.to_owned());
    match resolved(ty) {
        Type::Primitive(name) => value(primitive(*name).1),
        Type::Text { .. } => value("\"\""),
        Type::Sequence { element, .. } => Default::New(match dtype(element) {
            Some(dtype) => format!("_np.zeros(0, _np.{dtype})"),
            None => "[]".to_owned(),
        }),
        Type::Array { element, length } => Default::New(match dtype(element) {
            Some(dtype) => format!("_np.zeros({length}, _np.{dtype})"),
            None => match of_type(element, path, first) {
                Default::Value(value) => format!("[{value}] * {length}"),
                Default::New(new) => format!("[{new} for _ in range({length})]"),
            },
        }),
        Type::Dictionary { .. } => Default::New("{}".to_owned()),
        Type::Named(Named {
            module,
            name,
            of: Declared::Enum,
            ..
        }) => Default::Value(format!("{}.{}", path(module, name), first(module, name))),
        Type::Named(Named { module, name, .. }) => {
            Default::New(format!("{}()", path(module, name)))
        }
    }
}

/// A constant, or the default that a description writes.
pub(crate) fn value(value: &Value, path: Path) -> String {
    match resolved(&value.ty) {
        Type::Text { .. } => text(&value.text),
        Type::Named(Named { module, name, .. }) => {
            format!("{}.{}", path(module, name), names::shout(&value.text))
        }
        Type::Primitive(primitive) => match (primitive.class(), value.text.as_str()) {
            (Class::Bool, "true") => "True".to_owned(),
            (Class::Bool, _) => "False".to_owned(),
            (Class::Signed | Class::Unsigned | Class::Float, number) => number.to_owned(),
        },
        Type::Sequence { .. } | Type::Array { .. } | Type::Dictionary { .. } => value.text.clone(),
    }
}

/// A literal of a text: JSON's are Python's, too.
pub(crate) fn text(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}
