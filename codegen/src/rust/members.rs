//! Names and types of Rust for members, and for parameters as variables.

use super::types;
use crate::view::checks::Check;
use crate::view::documentation;
use crate::view::members;
use crate::view::types::{Type, resolved};
use serde::Serialize;

/// A member, or a parameter as a variable.
#[derive(Debug, Serialize)]
pub(super) struct Member<'a> {
    /// The name in the IDSL, for messages.
    pub(super) idsl: &'a str,
    pub(super) name: String,
    pub(super) doc: Vec<String>,
    pub(super) ty: String,
    pub(super) default: String,
    pub(super) optional: bool,
    pub(super) checks: &'a [Check],
    /// How a client or a publisher takes it.
    pub(super) borrowed: String,
    /// `value`, `text`, `sequence` or `reference`: what is to be written then.
    pub(super) write: &'static str,
}

pub(super) fn member<'a>(of: &'a members::Member, name: String, path: types::Path) -> Member<'a> {
    let default = match &of.default {
        Some(value) if of.optional => format!("Some({})", types::value(value, path)),
        Some(value) => types::value(value, path),
        None if is_long_array(&of.ty) && !of.optional => {
            "std::array::from_fn(|_| Default::default())".to_owned()
        }
        None => "Default::default()".to_owned(),
    };
    Member {
        idsl: &of.name,
        doc: documentation::of_member(of),
        ty: types::member(of, path),
        default,
        optional: of.optional,
        checks: &of.checks,
        borrowed: types::borrowed(of, path),
        write: match resolved(&of.ty) {
            _ if of.optional => "reference",
            Type::Text { .. } => "text",
            Type::Sequence { .. } => "sequence",
            ty if types::is_small(ty) => "value",
            Type::Primitive(_) | Type::Named(_) | Type::Array { .. } | Type::Dictionary { .. } => {
                "reference"
            }
        },
        name,
    }
}

/// The standard library has defaults of arrays of at most 32 elements.
pub(super) fn is_long_array(ty: &Type) -> bool {
    match resolved(ty) {
        Type::Array { element, length } => *length > 32 || is_long_array(element),
        _ => false,
    }
}
