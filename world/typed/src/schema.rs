//! The schema that generated code carries.

use graph_language::{DOMAINS, Schema};
use rc_diagnostics::{Format, SourceMap, render};
use rc_runtime::Core;
use rc_syntax::MemoryLoader;
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

/// The schema of these files, each with its name and its text; the first one names the others. `rcgen` has
/// checked them. Tools get them from the component.
///
/// # Errors
/// An error in the files.
pub fn schema(core: &Core, files: &[(&str, &str)]) -> Result<Arc<Schema>, String> {
    core.set_world_schema(files);
    let mut sources = SourceMap::new();
    let (name, text) = files.first().ok_or("there is no file")?;
    let source = sources.add(*name, *text);
    let loader = MemoryLoader::new(files.iter().copied());
    let (schema, found) = graph_language::load(&mut sources, &loader, source);
    match schema {
        Some(schema) if !found.has_errors() => Ok(schema.into()),
        _ => Err(render(&sources, &found, Format::Short)),
    }
}
