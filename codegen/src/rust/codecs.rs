//! The functions that write and read what an operation sends.

use super::{in_place, types};
use crate::view::types::{Named, Type};
use serde::Serialize;

/// The codecs of the parameters and the reply of an operation.
#[derive(Debug, Serialize)]
pub(super) struct Codecs {
    /// The functions that read the parameters, write a reply, and read it.
    pub(super) read: String,
    pub(super) reply: String,
    pub(super) take: String,
    /// Whether each of them, and writing the parameters, takes a function of its own.
    pub(super) own_read: bool,
    pub(super) own_write: bool,
    pub(super) own_reply: bool,
    pub(super) own_result: bool,
}

/// The structure of a type in shared memory; empty if there is none.
pub(super) fn placed(ty: Option<&Type>, path: types::Path) -> String {
    match ty {
        Some(Type::Named(Named { module, name, .. })) => in_place::path(&path(module, name)),
        _ => String::new(),
    }
}
