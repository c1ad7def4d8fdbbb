//! `rcgen query`, and `rcgen import` and `rcgen export` of graphs.

use crate::command_line::{Common, Target};
use crate::export::Request;
use crate::reports::{Failure, create, print_line, refuse_existing, refused, report, tell};
use graph_exchange::{Document, dsr, graph_json, graphml, shapes, turtle};
use graph_language::Schema;
use graph_query::{Budget, Cell, Queries, Query, Rows, Snapshot};
use rc_codegen::FileLoader;
use rc_diagnostics::{Diagnostics, SourceMap};
use rcgen::graphs::{Loaded, load, load_schema};
use rcgen::innermodel::Folders;
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Reads a graph; reports findings about its form.
pub(crate) fn loaded(
    file: &Path,
    sources: &mut SourceMap,
    common: &Common,
) -> Result<Loaded, Failure> {
    let loader = FileLoader::new(&common.include);
    let mut found = Diagnostics::new();
    let loaded = load(file, sources, &loader, &mut found).map_err(|e| refused(file, &e))?;
    report(sources, &found, common.format)?;
    loaded.ok_or(Failure::Input)
}

/// The widest column to which other cells are padded.
const WIDEST: usize = 200;

/// A value of the command line, whose type no schema says.
fn cell(text: &str) -> Cell {
    let number = text.parse().map(Cell::Int).ok();
    let float = || text.parse().ok().filter(|number: &f64| number.is_finite());
    let number = number.or_else(|| float().map(Cell::Float));
    number.unwrap_or_else(|| text.into())
}

/// A graph that is asked as it is: `check` says what does not fit its schema.
fn asked(file: &Path, loaded: &Loaded) -> Result<Arc<Snapshot>, Failure> {
    let graph = loaded.document.kept(&loaded.schema, 1);
    let graph = graph.map_err(|error| {
        tell(format_args!("{}: {error}", file.display()));
        Failure::Input
    })?;
    let unconverted = loaded.document.unconverted(&loaded.schema);
    if !unconverted.is_empty() {
        let types: Vec<&str> = unconverted.into_iter().collect();
        tell(format_args!(
            "{}: no value of {} is converted, since one is wrong or given twice; `rcgen check` names it",
            file.display(),
            types.join(", ")
        ));
    }
    Ok(graph.snapshot())
}

/// A query of a graph.
pub(crate) struct QueryRequest<'a> {
    pub(crate) file: &'a Path,
    /// A name, a text, or nothing to list all names.
    pub(crate) text: Option<&'a str>,
    pub(crate) parameters: &'a [String],
    /// Whether types and domains are nodes.
    pub(crate) is_reflected: bool,
    pub(crate) budget: Budget,
    pub(crate) common: &'a Common,
}

pub(crate) fn query(request: &QueryRequest<'_>) -> Result<(), Failure> {
    let QueryRequest {
        file,
        text,
        parameters,
        is_reflected,
        budget,
        common,
    } = *request;
    let mut sources = SourceMap::new();
    let mut loaded = loaded(file, &mut sources, common)?;
    if is_reflected {
        if loaded.is_dsr {
            // Edges have no ids there.
            loaded.document = with_ids(file, &loaded)?;
        }
        let reflected = loaded.document.reflected(&loaded.schema).ok_or_else(|| {
            let message = "the schema has a `Type`, `Domain`, `instance_of` or `is_a` of its own";
            Failure::Usage(message.to_owned())
        })?;
        (loaded.document, loaded.schema) = reflected;
    }
    let Some(text) = text else {
        for query in &loaded.schema.queries {
            let all = query.parameters.iter();
            let all = all.map(|(name, kind)| format!("{name} {kind}"));
            let all = all.collect::<Vec<_>>().join(", ");
            print_line(format_args!("{}({all})", query.name));
        }
        return Ok(());
    };
    let mut texts = Vec::new();
    for parameter in parameters {
        let Some(pair) = parameter.split_once('=') else {
            let message = format!("expected NAME=VALUE, found `{parameter}`");
            return Err(Failure::Usage(message));
        };
        texts.push(pair);
    }
    let graph = asked(file, &loaded)?;
    // A text is never a single word, but an empty one.
    let is_name = |c: char| c.is_alphanumeric() || c == '_';
    let rows = if !text.is_empty() && text.chars().all(is_name) {
        named(&graph, loaded.schema, text, &texts, budget)?
    } else {
        let values = texts
            .iter()
            .map(|(name, value)| ((*name).to_owned(), cell(value)));
        let values: HashMap<String, Cell> = values.collect();
        let source = sources.add("query", text);
        let known: HashSet<String> = values.keys().cloned().collect();
        let (query, found) = Query::with_parameters(&sources, source, &loaded.schema, &known);
        report(&sources, &found, common.format)?;
        let query = query.ok_or(Failure::Input)?;
        query.run(&graph, &values, budget).map_err(|e| failed(&e))?
    };
    table(&graph, &rows);
    Ok(())
}

fn failed(error: &graph_query::Error) -> Failure {
    tell(format_args!("error: {error}"));
    Failure::Input
}

/// Runs a query of the schema.
fn named(
    graph: &Snapshot,
    schema: Schema,
    name: &str,
    texts: &[(&str, &str)],
    budget: Budget,
) -> Result<Rows, Failure> {
    let queries = Queries::of(&Arc::new(schema));
    let wrong = |error: graph_query::Error| Failure::Usage(error.to_string());
    let mut values = Vec::new();
    for (parameter, text) in texts {
        let value = queries.argument(graph, name, parameter, text);
        values.push((*parameter, value.map_err(wrong)?));
    }
    queries
        .run(graph, name, values, budget)
        .map_err(|error| match error {
            graph_query::Error::UnknownQuery(..) | graph_query::Error::Parameter(_) => wrong(error),
            error => failed(&error),
        })
}

fn table(graph: &Snapshot, rows: &Rows) {
    let columns = rows.columns.iter().zip(&rows.units);
    let columns = columns.map(|(name, unit)| match unit {
        Some(unit) => rc_diagnostics::foreign::clean(&format!("{name} [{unit}]")),
        None => rc_diagnostics::foreign::clean(name),
    });
    let mut lines: Vec<Vec<String>> = vec![columns.collect()];
    for row in &rows.cells {
        lines.push(row.iter().map(|cell| cell.shown(graph)).collect());
    }
    let count = rows.columns.len();
    // One long cell does not move the others, and a width is a `u16` for the formatter.
    let long = |line: &Vec<String>, at: usize| line[at].chars().count().min(WIDEST);
    let width = |at: usize| lines.iter().map(|line| long(line, at)).max();
    let widths: Vec<usize> = (0..count).map(|at| width(at).unwrap_or_default()).collect();
    for line in &lines {
        let cells = line
            .iter()
            .zip(&widths)
            .map(|(cell, width)| format!("{cell:<width$}"));
        let cells: Vec<String> = cells.collect();
        print_line(format_args!("{}", cells.join("  ").trim_end()));
    }
}

/// The document of a file of DSR, whose edges have the ids that a graph gives them.
fn with_ids(file: &Path, loaded: &Loaded) -> Result<Document, Failure> {
    let mut document = Document::of(&*asked(file, loaded)?);
    document.schema = Some("dsr.gdsl".to_owned());
    Ok(document)
}

/// Makes one graph of several. The first file that names a schema says which one the new file names.
pub(crate) fn join(files: &[PathBuf], out: &Path, common: &Common) -> Result<(), Failure> {
    let mut joined = Document::default();
    let mut schema = Schema::anything();
    for file in files {
        let mut sources = SourceMap::new();
        let loaded = loaded(file, &mut sources, common)?;
        let had_schema = joined.schema.is_some();
        let schemas = (&schema, &loaded.schema);
        joined.join(&loaded.document, schemas).map_err(|error| {
            tell(format_args!("{}: {error}", file.display()));
            Failure::Input
        })?;
        if !had_schema {
            schema = loaded.schema;
        }
    }
    create(out, graph_json::write(&joined).as_bytes(), "file", false)
}

/// Takes a graph over into another schema. Lists the different declarations, and what does not fit.
pub(crate) fn migrate(
    file: &Path,
    out: &Path,
    schema: &Path,
    common: &Common,
) -> Result<(), Failure> {
    let mut sources = SourceMap::new();
    let loaded = loaded(file, &mut sources, common)?;
    let mut found =
        graph_exchange::check(&loaded.document, &loaded.schema, &sources, loaded.source);
    let loader = FileLoader::new(&common.include);
    let new = load_schema(schema, &mut sources, &loader, &mut found);
    let new = new.map_err(|error| refused(schema, &error))?;
    report(&sources, &found, common.format)?;
    let (new, _) = new.ok_or(Failure::Input)?;
    let wrong = |why: String| {
        tell(format_args!("{}: {why}", file.display()));
        Failure::Input
    };
    let graph = loaded.document.graph(loaded.schema.into(), 1);
    let graph = graph.map_err(|error| wrong(error.to_string()))?;
    let migration = graph_exchange::migrate(&graph.snapshot(), &Arc::new(new), 1);
    for difference in &migration.differences {
        tell(format_args!("{difference}"));
    }
    // Their places are those of the file as `rcgen fmt` writes it.
    for finding in &migration.findings {
        tell(format_args!("{finding}"));
    }
    let Some(graph) = migration.graph else {
        return Err(wrong(format!("does not fit {}", schema.display())));
    };
    let mut document = Document::of(&graph.snapshot());
    let name = schema.file_name().unwrap_or_default();
    document.schema = Some(name.to_string_lossy().into_owned());
    create(out, graph_json::write(&document).as_bytes(), "file", false)
}

pub(crate) fn import(file: &Path, out: &Path, common: &Common) -> Result<(), Failure> {
    let mut sources = SourceMap::new();
    let ending = file.extension().and_then(|ending| ending.to_str());
    let (document, found) = match ending {
        Some("json") => {
            let loaded = loaded(file, &mut sources, common)?;
            (with_ids(file, &loaded)?, Diagnostics::new())
        }
        Some("xml" | "urdf") => {
            let text = rc_files::read(file).map_err(|error| refused(file, &error))?;
            let source = sources.add(file, text);
            if ending == Some("urdf") {
                let (robot, found) = rc_robot::read(&sources, source);
                (graph_exchange::robot::document(&robot), found)
            } else {
                let folders = Folders { search: &[] };
                let (tree, found) = innermodel_language::load(&mut sources, &folders, source);
                (graph_exchange::innermodel::document(&tree), found)
            }
        }
        _ => {
            let message = format!("{} is no .json, .xml or .urdf file", file.display());
            return Err(Failure::Usage(message));
        }
    };
    report(&sources, &found, common.format)?;
    create(out, graph_json::write(&document).as_bytes(), "file", false)
}

/// Writes the frames of a graph, with their bodies, as an InnerModel file.
pub(crate) fn scene(file: &Path, out: &Path, common: &Common) -> Result<(), Failure> {
    let mut sources = SourceMap::new();
    let loaded = loaded(file, &mut sources, common)?;
    if !loaded.schema.has_transforms() {
        tell(format_args!(
            "{}: its schema has no relation with poses, such as `RT` of geometry.gdsl",
            file.display()
        ));
        return Err(Failure::Input);
    }
    let graph = loaded.document.graph(loaded.schema.into(), 1);
    let graph = graph.map_err(|error| {
        tell(format_args!("{}: {error}", file.display()));
        Failure::Input
    })?;
    let tree = graph_exchange::innermodel::tree(&graph.snapshot());
    let text = innermodel_language::print(&tree);
    create(out, text.as_bytes(), "file", false)
}

pub(crate) fn export(request: &Request<'_>) -> Result<(), Failure> {
    let file = request.file;
    let mut sources = SourceMap::new();
    let mut loaded = loaded(file, &mut sources, request.common)?;
    let mut name = file.file_stem().unwrap_or_default().to_string_lossy();
    if let Some(domain) = request.domain {
        if loaded.is_dsr {
            loaded.document = with_ids(file, &loaded)?;
        }
        check_domain(&loaded.schema, domain)?;
        loaded.document = loaded.document.part(&loaded.schema, domain);
        name = format!("{name}.{domain}").into();
    } else if matches!(request.target, Target::Graph) {
        let message = "`--to graph` needs `--domain`; `rcgen import` makes a whole graph";
        return Err(Failure::Usage(message.to_owned()));
    }
    let (text, ending) = match request.target {
        Target::Dsr => {
            let (text, lost) = dsr::write(&loaded.document);
            for lost in lost {
                tell(format_args!("warning: {lost}"));
            }
            (text, "json")
        }
        Target::Graph => (graph_json::write(&loaded.document), "graph"),
        Target::Turtle => {
            // Both files, or none.
            refuse_existing(&request.out.join(format!("{name}.ttl")), "folder")?;
            let path = request.out.join(format!("{name}.shapes.ttl"));
            let text = shapes::write(&loaded.schema);
            create(&path, text.as_bytes(), "folder", request.dry_run)?;
            (turtle::write(&loaded.document, &loaded.schema), "ttl")
        }
        _ => (graphml::write(&loaded.document), "graphml"),
    };
    let path = request.out.join(format!("{name}.{ending}"));
    create(&path, text.as_bytes(), "folder", request.dry_run)
}

/// Refuses a domain that a schema and its imports do not declare.
fn check_domain(schema: &Schema, domain: &str) -> Result<(), Failure> {
    let known = graph_exchange::domains(schema);
    if known.contains(&domain) {
        return Ok(());
    }
    let hint = match rc_diagnostics::nearest(domain, known.iter().copied()) {
        Some(near) => format!("did you mean `{near}`?"),
        None => format!("it has {}", Vec::from_iter(known).join(", ")),
    };
    let message = format!("the schema has no domain `{domain}`; {hint}");
    Err(Failure::Usage(message))
}
