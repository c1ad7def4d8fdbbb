//! Names and types of a view in Rust, and the layout of its code. A view lists what there is;
//! the templates in `templates/rust` hold the code.

mod adapter;
mod asynchronous;
mod checks;
mod codecs;
pub(crate) mod component;
pub(crate) mod context_names;
mod exports;
mod freshness;
mod handlers;
mod in_place;
mod interface;
mod layout;
pub(crate) mod library;
pub(crate) mod machine;
pub(crate) mod meanings;
mod members;
pub mod names;
mod operation;
mod operation_names;
mod parameters;
pub(crate) mod print;
mod qos;
mod reexports;
mod shapes;
mod slot;
pub(crate) mod state_names;
mod testing;
mod types;
pub mod worker;
pub(crate) mod worker_traits;
mod world;

use crate::collisions::{self, Naming};
use rc_diagnostics::Diagnostics;
use rc_idsl::Library;

/// The texts that are there.
fn those<'a>(all: &[(&'a str, bool)]) -> Vec<&'a str> {
    let there = all.iter().filter(|(_, there)| *there);
    there.map(|(text, _)| *text).collect()
}

/// Reports names of the IDSL that become one name of Rust.
pub(crate) fn check(library: &Library, found: &mut Diagnostics) {
    const NAMING: Naming = Naming {
        language: "Rust",
        module: names::module,
        ty: names::ty,
        enumerator: names::camel,
        member: names::snake,
        operation: names::method,
        parameter: names::local,
        exception: operation_names::variant,
    };
    collisions::check(library, &NAMING, found);
}
