//! The files of a world: its schema, its start file, and the file that keeps it.

use graph_exchange::{Document, dsr, graph_json};
use graph_language::Schema;
use property_graph::{Graph, Snapshot};
use rc_diagnostics::{Diagnostics, Format, SourceMap, render};
use std::path::Path;
use std::sync::Arc;

fn cannot(path: &Path, error: &std::io::Error) -> String {
    format!("cannot read {}: {error}", path.display())
}

fn sound(sources: &SourceMap, found: &Diagnostics) -> Result<(), String> {
    if found.has_errors() {
        return Err(render(sources, found, Format::Human));
    }
    Ok(())
}

/// The schema of a world: a file, or a domain that comes with the tools.
pub(crate) fn schema(path: &Path) -> Result<Schema, String> {
    if path.as_os_str().is_empty() {
        return Ok(Schema::anything());
    }
    graph_language::open(&mut SourceMap::new(), path, rc_files::read)
}

/// A graph with which a world starts: a `.graph` file, or one of DSR.
pub(crate) fn graph(path: &Path, schema: &Arc<Schema>) -> Result<Arc<Snapshot>, String> {
    let text = rc_files::read(path).map_err(|error| cannot(path, &error))?;
    let mut sources = SourceMap::new();
    let (source, mark) = graph_exchange::add(&mut sources, path, text);
    if let Some(mark) = mark {
        let mut found = Diagnostics::new();
        found.push(mark);
        return Err(render(&sources, &found, Format::Human));
    }
    let (document, mut found) = if dsr::is_dsr(sources.text(source)) {
        dsr::read(&sources, source)
    } else {
        graph_json::read(&sources, source)
    };
    sound(&sources, &found)?;
    let document = document.ok_or_else(|| render(&sources, &found, Format::Human))?;
    found.extend(graph_exchange::check(&document, schema, &sources, source));
    sound(&sources, &found)?;
    let made: Result<Graph, _> = document.graph(Arc::clone(schema), 2);
    let made = made.map_err(|error| format!("{}: {error}", path.display()))?;
    Ok(made.snapshot())
}

/// Keeps a world in a file, which is whole at any moment.
pub(crate) fn keep(path: &Path, schema: &Path, world: &Snapshot) -> Result<(), String> {
    let mut document = Document::of(world);
    let named = schema.to_str().filter(|name| !name.is_empty());
    document.schema = named.map(str::to_owned);
    let written = rc_files::write(path, graph_json::write(&document));
    written.map_err(|error| format!("cannot write {}: {error}", path.display()))
}
