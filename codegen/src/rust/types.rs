//! Types and values as Rust writes them.

use super::names;
use crate::view::members::{Member, Value};
use crate::view::types::{Declared, Named, Type, resolved};

/// The path of a named type, from its module and its name in the IDSL.
pub(crate) type Path<'a> = &'a dyn Fn(&str, &str) -> String;

/// A type in the file of the module `home`: its own types by their bare names.
pub(crate) fn in_module(home: &str) -> impl Fn(&str, &str) -> String {
    move |module, name| {
        let name = names::ty(name);
        if module == home {
            name
        } else {
            format!("crate::{}::{name}", names::module(module))
        }
    }
}

/// A type in the module of an interface, which is inside that of its types.
pub(crate) fn in_interface(home: &str) -> impl Fn(&str, &str) -> String {
    move |module, name| {
        let name = names::ty(name);
        if module == home {
            format!("super::{name}")
        } else {
            format!("crate::{}::{name}", names::module(module))
        }
    }
}

/// A type anywhere in the crate `interfaces`.
pub(crate) fn in_crate() -> impl Fn(&str, &str) -> String {
    |module, name| format!("crate::{}::{}", names::module(module), names::ty(name))
}

/// A type that owns its value.
pub(crate) fn owned(ty: &Type, path: Path) -> String {
    match ty {
        Type::Primitive(name) => name.rust().to_owned(),
        Type::Text { .. } => "String".to_owned(),
        Type::Sequence { element, .. } => format!("Vec<{}>", owned(element, path)),
        Type::Array { element, length } => format!("[{}; {length}]", owned(element, path)),
        Type::Dictionary { key, value } => format!(
            "std::collections::BTreeMap<{}, {}>",
            owned(key, path),
            owned(value, path)
        ),
        Type::Named(Named { module, name, .. }) => path(module, name),
    }
}

/// The owned type of a member, which may be optional.
pub(crate) fn member(member: &Member, path: Path) -> String {
    let ty = owned(&member.ty, path);
    if member.optional {
        format!("Option<{ty}>")
    } else {
        ty
    }
}

/// The form in which a client or a publisher takes a parameter: small values by value, the rest by
/// reference.
pub(crate) fn borrowed(parameter: &Member, path: Path) -> String {
    if parameter.optional {
        return format!("&{}", member(parameter, path));
    }
    match resolved(&parameter.ty) {
        Type::Text { .. } => "&str".to_owned(),
        Type::Sequence { element, .. } => format!("&[{}]", owned(element, path)),
        ty if is_small(ty) => owned(&parameter.ty, path),
        Type::Primitive(_) | Type::Named(_) | Type::Array { .. } | Type::Dictionary { .. } => {
            format!("&{}", owned(&parameter.ty, path))
        }
    }
}

/// Whether values are copied instead of borrowed.
pub(crate) fn is_small(ty: &Type) -> bool {
    matches!(
        resolved(ty),
        Type::Primitive(_)
            | Type::Named(Named {
                of: Declared::Enum,
                ..
            })
    )
}

/// A value that owns itself; a text is a `String`.
pub(crate) fn value(value: &Value, path: Path) -> String {
    match resolved(&value.ty) {
        Type::Text { .. } => format!("{:?}.to_owned()", value.text),
        Type::Named(Named { module, name, .. }) => {
            format!("{}::{}", path(module, name), names::camel(&value.text))
        }
        Type::Primitive(_)
        | Type::Sequence { .. }
        | Type::Array { .. }
        | Type::Dictionary { .. } => value.text.clone(),
    }
}
