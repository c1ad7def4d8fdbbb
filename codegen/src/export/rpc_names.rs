//! The names of the types that an interface becomes in the service mapping of DDS-RPC.

use super::uses::{has_calls, is_call, is_topic};
use rc_diagnostics::{Diagnostic, Diagnostics};
use rc_idsl::Library;
use rc_idsl::model::{Interface, Module};
use rc_syntax::Name;

/// The name of the constant with the hash of an exception.
pub(super) fn exception_hash(exception: &str) -> String {
    format!("{exception}_Ex_Hash")
}

/// All names that an interface generates, each with its declaration.
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

/// Reports exceptions of one operation with equal names. DDS-RPC identifies them by the hash of the
/// name without module.
pub(super) fn exceptions_collide(library: &Library, module: &Module, found: &mut Diagnostics) {
    let interfaces = module.interfaces.iter().map(|i| library.interface(*i));
    for operation in interfaces.flat_map(|i| &i.operations) {
        let mut seen: Vec<&Name> = Vec::new();
        for exception in operation.throws.iter().map(|t| &library.ty(*t).name) {
            if let Some(first) = seen.iter().find(|first| first.text == exception.text) {
                let message = format!(
                    "`{}` throws two exceptions named `{}`, which DDS-RPC cannot distinguish",
                    operation.name.text, exception.text
                );
                found.push(
                    Diagnostic::error("export-name", operation.name.span, message)
                        .label(first.span, "first exception")
                        .label(exception.span, "second exception"),
                );
            }
            seen.push(exception);
        }
    }
}
