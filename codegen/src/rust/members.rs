//! Names and types of Rust for members, and for parameters as variables.

use super::checks::{self, Place, READS, ValuePlace, WRITES};
use super::types;
use crate::view::documentation;
use crate::view::members;
use crate::view::types::{Type, resolved};
use serde::Serialize;

/// A member of a structure or an exception.
#[derive(Debug, Serialize)]
pub(super) struct Member {
    name: String,
    doc: Vec<String>,
    ty: String,
    default: String,
    /// The statements that check it in `self`, which is written, and in `value`, which was read.
    written: String,
    read: String,
}

/// A member of the structure `owner`.
pub(super) fn member(of: &members::Member, owner: &str, name: String, path: types::Path) -> Member {
    let what = format!("{owner}.{}", of.name);
    let check = |value: &str, side| {
        let place = Place {
            what: &what,
            name: &format!("{value}.{name}"),
            held: ValuePlace::Owned,
        };
        checks::of_member(of, place, side)
    };
    Member {
        doc: documentation::of_member(of),
        ty: types::member(of, path),
        default: match &of.default {
            Some(value) if of.optional => format!("Some({})", types::value(value, path)),
            Some(value) => types::value(value, path),
            None if is_long_array(&of.ty) && !of.optional => {
                "std::array::from_fn(|_| Default::default())".to_owned()
            }
            None => "Default::default()".to_owned(),
        },
        written: check("self", WRITES),
        read: check("value", READS),
        name,
    }
}

/// A parameter, as an argument of a client or a publisher.
pub(super) struct Input {
    pub(super) name: String,
    pub(super) ty: String,
    /// Its type as an argument.
    pub(super) borrowed: String,
    /// The expression for its place in what is sent.
    pub(super) sent: String,
    /// The statements that check it as an argument, and as a variable that was read.
    pub(super) written: String,
    pub(super) read: String,
}

/// A parameter of an operation, which errors call `owner`.
pub(super) fn input(of: &members::Member, owner: &str, name: String, path: types::Path) -> Input {
    let what = format!("{owner}.{}", of.name);
    let check = |held, side| {
        let place = Place {
            what: &what,
            name: &name,
            held,
        };
        checks::of_member(of, place, side)
    };
    let by_value = !of.optional && types::is_small(&of.ty);
    Input {
        ty: types::member(of, path),
        borrowed: types::borrowed(of, path),
        sent: format!("{}{name}", if by_value { "&" } else { "" }),
        written: check(ValuePlace::Argument, WRITES),
        read: check(ValuePlace::Owned, READS),
        name,
    }
}

/// The standard library has defaults of arrays of at most 32 elements.
pub(super) fn is_long_array(ty: &Type) -> bool {
    match resolved(ty) {
        Type::Array { element, length } => *length > 32 || is_long_array(element),
        Type::Primitive(_)
        | Type::Text { .. }
        | Type::Sequence { .. }
        | Type::Dictionary { .. }
        | Type::Named(_) => false,
    }
}
