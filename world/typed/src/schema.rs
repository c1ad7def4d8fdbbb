//! The schema that generated code carries.

use graph_language::Schema;
use rc_diagnostics::{Format, SourceMap, render};
use rc_runtime::Core;
use rc_syntax::MemoryLoader;
use std::sync::Arc;

/// The schema of these files, each with its name and its text; the first one names the others. `rcgen` has
/// checked them. Tools get them from the component.
///
/// # Errors
/// What is wrong with the files.
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
