//! Files of graphs: `.graph`, and the JSON of DSR.

use graph_exchange::{Document, dsr, graph_json};
use graph_language::Schema;
use rc_diagnostics::{Diagnostic, Diagnostics, SourceId, SourceMap, Span};
use rc_syntax::Loader;
use std::io;
use std::path::Path;

/// A graph with the schema that its file names.
#[derive(Debug)]
pub struct Loaded {
    /// The graph as the file has it.
    pub document: Document,
    /// Its schema: that of DSR for a file of DSR.
    pub schema: Schema,
    /// The file.
    pub source: SourceId,
    /// Whether it is a file of DSR.
    pub is_dsr: bool,
}

/// Reads a graph and its schema. Adds findings about the form of both, not about whether they fit.
pub fn load(
    path: &Path,
    sources: &mut SourceMap,
    loader: &dyn Loader,
    found: &mut Diagnostics,
) -> io::Result<Option<Loaded>> {
    let (source, mark) = graph_exchange::add(sources, path, rc_files::read(path)?);
    if let Some(mark) = mark {
        found.push(mark);
        return Ok(None);
    }
    let is_dsr = dsr::is_dsr(sources.text(source));
    if !is_dsr && path.extension().is_some_and(|ending| ending == "json") {
        let message = "this is no file of DSR: it does not begin with `DSRModel`";
        let span = Span::new(source, 0, 0);
        found.push(Diagnostic::error("other-format", span, message));
        return Ok(None);
    }
    let (document, more) = if is_dsr {
        dsr::read(sources, source)
    } else {
        graph_json::read(sources, source)
    };
    found.extend(more);
    let Some(document) = document else {
        return Ok(None);
    };
    let schema = match (&document.schema, is_dsr) {
        (_, true) => graph_language::builtin("dsr.gdsl").unwrap_or_default(),
        (None, false) => Schema::anything(),
        (Some(name), false) => {
            let span = graph_json::schema_span(sources, source);
            match named(path, name, span, sources, loader, found) {
                Some(schema) => schema,
                None => return Ok(None),
            }
        }
    };
    Ok(Some(Loaded {
        document,
        schema,
        source,
        is_dsr,
    }))
}

/// The schema that a file names: beside it, in a folder of `-I`, or one that comes with the tools.
fn named(
    path: &Path,
    name: &str,
    span: Span,
    sources: &mut SourceMap,
    loader: &dyn Loader,
    found: &mut Diagnostics,
) -> Option<Schema> {
    let file = match loader.find(path, name, "gdsl") {
        Ok(file) => file,
        Err(missing) => {
            if let Some(schema) = graph_language::builtin(name) {
                return Some(schema);
            }
            found.push(missing.diagnostic(name, "gdsl", span));
            return None;
        }
    };
    let source = sources.add(file.path, file.text);
    let (schema, more) = graph_language::load(sources, loader, source);
    let right = !more.has_errors();
    found.extend(more);
    schema.filter(|_| right)
}

/// Adds all that is wrong with a graph to `found`.
pub fn check(
    path: &Path,
    sources: &mut SourceMap,
    loader: &dyn Loader,
    found: &mut Diagnostics,
) -> io::Result<()> {
    if let Some(loaded) = load(path, sources, loader, found)? {
        let more = graph_exchange::check(&loaded.document, &loaded.schema, sources, loaded.source);
        found.extend(more);
    }
    Ok(())
}
