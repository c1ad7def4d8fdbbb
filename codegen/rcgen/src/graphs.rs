//! Files of graphs: `.graph`, the JSON of DSR, and `.gdsl` with the queries in it.

use graph_exchange::{Document, dsr, graph_json};
use graph_language::Schema;
use graph_language::ast::Item;
use graph_query::Query;
use rc_diagnostics::{Diagnostic, Diagnostics, SourceId, SourceMap, Span};
use rc_syntax::{Loader, Name};
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

/// Reads a graph and its schema, or a URDF as a graph of the domain `kinematics`. Adds findings about the form of both, not about
/// whether they fit.
pub fn load(
    path: &Path,
    sources: &mut SourceMap,
    loader: &dyn Loader,
    found: &mut Diagnostics,
) -> io::Result<Option<Loaded>> {
    if path.extension().is_some_and(|ending| ending == "urdf") {
        let source = sources.add(path, rc_files::read(path)?);
        let (robot, more) = rc_robot::read(sources, source);
        found.extend(more);
        let document = graph_exchange::robot::document(&robot);
        let schema = document.schema.as_deref();
        return Ok(Some(Loaded {
            schema: schema.and_then(graph_language::builtin).unwrap_or_default(),
            document,
            source,
            is_dsr: false,
        }));
    }
    let (source, mark) = graph_exchange::add(sources, path, rc_files::read(path)?);
    if let Some(mark) = mark {
        found.push(mark);
        return Ok(None);
    }
    let is_dsr = dsr::is_dsr(sources.text(source));
    if !is_dsr && path.extension().is_some_and(|ending| ending == "json") {
        let message = "this is not a file of DSR: it does not begin with `DSRModel`";
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

/// The schema that a file names: in its folder, in a folder of `-I`, or among those that come with
/// the tools.
fn named(
    path: &Path,
    name: &str,
    span: Span,
    sources: &mut SourceMap,
    loader: &dyn Loader,
    found: &mut Diagnostics,
) -> Option<Schema> {
    let (schema, more) = graph_language::import(sources, loader, path, &Name::new(name, span));
    found.extend(more);
    schema
}

/// Reads a `.gdsl` file with its imports. Adds all that is wrong with it to `found`, but not in the
/// texts of its queries.
pub fn load_schema(
    path: &Path,
    sources: &mut SourceMap,
    loader: &dyn Loader,
    found: &mut Diagnostics,
) -> io::Result<Option<(Schema, SourceId)>> {
    let source = sources.add(path, rc_files::read(path)?);
    let (schema, more) = graph_language::load(sources, loader, source);
    let right = !more.has_errors();
    found.extend(more);
    let schema = schema.filter(|_| right);
    Ok(schema.map(|schema| (schema, source)))
}

/// Adds all findings about a `.gdsl` file to `found`, also in the texts of its queries; for a file
/// that is `known`, only those in these texts.
pub fn check_schema(
    path: &Path,
    known: bool,
    sources: &mut SourceMap,
    loader: &dyn Loader,
    found: &mut Diagnostics,
) -> io::Result<()> {
    let mut own = Diagnostics::new();
    let loaded = load_schema(path, sources, loader, &mut own)?;
    if !known {
        found.extend(own);
    }
    // A query would only report wrong declarations again.
    if let Some((schema, source)) = loaded {
        found.extend(queries(sources, source, &schema));
    }
    Ok(())
}

/// Compares the queries of a file with its schema.
fn queries(sources: &SourceMap, source: SourceId, schema: &Schema) -> Diagnostics {
    let mut found = Diagnostics::new();
    let (file, _) = graph_language::parse(sources, source);
    for item in file.domain.into_iter().flat_map(|domain| domain.items) {
        let Item::Query(query) = item else { continue };
        let names = query.parameters.into_iter().map(|(name, _)| name.text);
        let mut inside = SourceMap::new();
        let text = inside.add("query", query.text.text.as_str());
        let names = names.collect();
        let (_, more) = Query::with_parameters(&inside, text, schema, &names);
        let written = query.text.span;
        let quoted = sources.text(source).get(written.start..written.end);
        // If there are escapes, places inside do not correspond: the finding is at the whole text.
        let is_as_written = quoted
            .and_then(|quoted| quoted.strip_prefix('"')?.strip_suffix('"'))
            .is_some_and(|inner| inner == query.text.text);
        let placed = |span: Span| {
            if is_as_written {
                let start = written.start + 1;
                Span::new(source, start + span.start, start + span.end)
            } else {
                written
            }
        };
        for mut finding in more {
            finding.span = placed(finding.span);
            for label in &mut finding.labels {
                label.span = placed(label.span);
            }
            found.push(finding);
        }
    }
    found
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

/// The text of a `.graph` file with one node or edge a line, in the order of ids, attributes in that of
/// names.
///
/// # Errors
/// The findings of a file that cannot be read.
pub fn format(sources: &SourceMap, source: SourceId) -> Result<String, Diagnostics> {
    let (document, found) = graph_json::read(sources, source);
    match document {
        Some(document) if !found.has_errors() => {
            let text = graph_json::write(&document);
            Ok(rc_syntax::with_ends_of(sources.text(source), text))
        }
        _ => Err(found),
    }
}
