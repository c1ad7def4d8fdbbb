//! The names of the types that an interface becomes in the service mapping of DDS-RPC.

use super::uses::{has_calls, is_call, is_topic};
use rc_diagnostics::{Diagnostic, Diagnostics};
use rc_idsl::Library;
use rc_idsl::model::{Interface, Module};
use rc_syntax::Name;

/// The constant with the hash of an exception.
pub(super) fn exception_hash(exception: &str) -> String {
    format!("{exception}_Ex_Hash")
}

/// All that an interface becomes, and what in it is the reason.
pub(super) fn names(interface: &Interface) -> Vec<(String, &Name)> {
    let own = &interface.name.text;
    let mut names = Vec::new();
    for operation in &interface.operations {
        let base = format!("{own}_{}", operation.name.text);
        if is_call(interface, operation) {
            let all = ["Hash", "In", "Out", "Result"].into_iter();
            names.extend(all.map(|end| (format!("{base}_{end}"), &operation.name)));
        }
        if is_topic(interface, operation) {
            names.push((base, &operation.name));
        }
    }
    if has_calls(interface) {
        let all = ["Call", "Request", "Return", "Reply"].into_iter();
        names.extend(all.map(|end| (format!("{own}_{end}"), &interface.name)));
    }
    names
}

/// Exceptions of one operation are told apart by the hashes of their names, without the module.
pub(super) fn exceptions_collide(library: &Library, module: &Module, found: &mut Diagnostics) {
    let interfaces = module.interfaces.iter().map(|i| library.interface(*i));
    for operation in interfaces.flat_map(|i| &i.operations) {
        let mut seen: Vec<&Name> = Vec::new();
        for exception in operation.throws.iter().map(|t| &library.ty(*t).name) {
            if let Some(first) = seen.iter().find(|first| first.text == exception.text) {
                let message = format!(
                    "`{}` throws two exceptions called `{}`, which are one in the envelope of calls",
                    operation.name.text, exception.text
                );
                found.push(
                    Diagnostic::error("export-name", operation.name.span, message)
                        .label(first.span, "one")
                        .label(exception.span, "the other one"),
                );
            }
            seen.push(exception);
        }
    }
}
