//! Names and types of a view in Python. A view lists what there is; the templates in
//! `templates/python` contain the code.

pub(crate) mod checks;
pub(crate) mod component;
pub mod component_interpreter;
mod documentation;
pub mod environment;
pub mod environment_copy;
mod handlers;
mod imports;
mod interfaces;
pub mod interpreter;
mod layout;
mod library;
mod machine;
pub mod names;
mod parameters;
pub(crate) mod places;
pub(crate) mod print;
pub(crate) mod reply_order;
mod source;
pub mod stubs;
mod testing;
mod types;
mod world;

use crate::collisions::{self, Naming};
use rc_diagnostics::Diagnostics;
use rc_idsl::Library;

/// Reports names of the IDSL that become one name of Python.
pub(crate) fn check(library: &Library, found: &mut Diagnostics) {
    const NAMING: Naming = Naming {
        language: "Python",
        module: names::module,
        ty: names::class,
        enumerator: names::shout,
        member: names::exception_member,
        operation: names::method,
        parameter: names::parameter,
        exception: names::class,
    };
    collisions::check(library, &NAMING, found);
    interfaces::check(library, found);
}

/// The functions of every worker.
pub(crate) const HOOKS: [&str; 12] = [
    "initialize",
    "compute",
    "params_changed",
    "emergency",
    "restore",
    "finalize",
    "configure",
    "activate",
    "deactivate",
    "cleanup",
    "shutdown",
    "error",
];
