//! The meaning of names in the user's files.

use super::operation_names::{answer_name, error_name};
use super::{names, types};
use crate::view;
use crate::view::library::Interface;

/// Names that denote other types in the user's files, with these types, and names that denote
/// themselves.
pub(crate) fn of(view: &view::Component) -> (Vec<(String, String)>, Vec<String>) {
    let (mut aliases, mut known) = (Vec::new(), Vec::new());
    let bare = |_: &str, name: &str| names::ty(name);
    for decl in view.modules.iter().flat_map(|module| &module.types) {
        match &decl.kind {
            view::library::Kind::Alias { target } => {
                aliases.push((names::ty(&decl.name), types::owned(target, &bare)));
            }
            view::library::Kind::Enum { .. }
            | view::library::Kind::Struct { .. }
            | view::library::Kind::Exception { .. } => known.push(names::ty(&decl.name)),
        }
    }
    let used = |interface: &&Interface| {
        let mut slots = view.slots.iter();
        slots.any(|s| s.module == interface.module && s.interface == interface.name)
    };
    let interfaces = view.modules.iter().flat_map(|module| &module.interfaces);
    for operation in interfaces.filter(used).flat_map(|i| &i.operations) {
        let result = operation.result.iter().map(|ty| types::owned(ty, &bare));
        let outputs = operation.outputs.iter().map(|m| types::member(m, &bare));
        let parts: Vec<String> = result.chain(outputs).collect();
        if parts.len() > 1 {
            let tuple = format!("({})", parts.join(", "));
            aliases.push((answer_name(&operation.name), tuple));
        }
        if !operation.throws.is_empty() {
            known.push(error_name(&operation.name));
        }
    }
    (aliases, known)
}
