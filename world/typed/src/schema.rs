//! The schema that generated code carries.

use graph_language::{DOMAINS, Schema};
use rc_runtime::Core;
use std::sync::Arc;

/// A domain that comes with the framework, as a file of a schema: its name and its text.
///
/// # Panics
/// There is no such domain. Generated code names those that are there.
pub const fn domain(name: &str) -> (&'static str, &'static str) {
    let mut at = 0;
    while at < DOMAINS.len() {
        if are_equal(DOMAINS[at].0.as_bytes(), name.as_bytes()) {
            return DOMAINS[at];
        }
        at += 1;
    }
    panic!("there is no such domain")
}

const fn are_equal(one: &[u8], other: &[u8]) -> bool {
    let mut at = 0;
    while at < one.len() && at < other.len() && one[at] == other[at] {
        at += 1;
    }
    at == one.len() && at == other.len()
}

/// The schema of a component that was generated from these files, each with its name and its text; the
/// first one names the others. `rcgen` has checked them. If the schema of the network has more, it is
/// that one. Tools get its files from the component.
///
/// # Errors
/// An error in the files, or the network declares something else.
pub fn schema(core: &Core, files: &[(&str, &str)]) -> Result<Arc<Schema>, String> {
    let given = core.world_schema();
    if given.is_empty() {
        core.set_world_schema(files);
    }
    graph_language::of_component(files, &given).map(Arc::new)
}
