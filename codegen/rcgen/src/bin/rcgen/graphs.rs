//! `rcgen query`, and `rcgen import` and `rcgen export` of graphs.

use crate::command_line::{Common, Target};
use crate::export::Request;
use crate::reports::{Failure, create, print_line, refused, report, tell};
use graph_exchange::{Document, dsr, graph_json, graphml};
use graph_query::{Budget, Cell, Query};
use innermodel_exchange::urdf;
use rc_codegen::FileLoader;
use rc_diagnostics::{Diagnostics, Format, SourceMap};
use rcgen::graphs::{Loaded, load};
use rcgen::innermodel::Folders;
use std::collections::{HashMap, HashSet};
use std::path::Path;

/// Reads a graph; reports findings about its form.
fn loaded(file: &Path, sources: &mut SourceMap, common: &Common) -> Result<Loaded, Failure> {
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

pub(crate) fn query(
    file: &Path,
    text: &str,
    parameters: &[String],
    budget: Budget,
    common: &Common,
) -> Result<(), Failure> {
    let (mut values, mut texts) = (HashMap::new(), HashMap::new());
    for parameter in parameters {
        let Some((name, value)) = parameter.split_once('=') else {
            let message = format!("expected NAME=VALUE, found `{parameter}`");
            return Err(Failure::Usage(message));
        };
        values.insert(name.to_owned(), cell(value));
        texts.insert(name, value);
    }
    let mut sources = SourceMap::new();
    let loaded = loaded(file, &mut sources, common)?;
    // The graph is asked as it is: `check` says what does not fit its schema.
    let graph = loaded.document.kept(&loaded.schema, 1);
    let graph = graph.map_err(|error| {
        tell(format_args!("{}: {error}", file.display()));
        Failure::Input
    })?;
    let graph = graph.snapshot();
    let named = loaded
        .schema
        .queries
        .iter()
        .find(|query| query.name == text);
    let text = named.map_or(text, |query| query.text.as_str());
    if let Some(query) = named {
        // A parameter that is a node is given by its name.
        for (name, kind) in &query.parameters {
            let Some(value) = texts.get(name.as_str()) else {
                continue;
            };
            if loaded.schema.entity(kind).is_some() {
                let Some(node) = graph.named(value).next() else {
                    return Err(Failure::Usage(format!("no node has the name `{value}`")));
                };
                values.insert(name.clone(), Cell::Node(node));
            } else if kind == "string" {
                values.insert(name.clone(), (*value).into());
            }
        }
    }
    let source = sources.add("query", text);
    let known: HashSet<String> = values.keys().cloned().collect();
    let (query, found) = Query::with_parameters(&sources, source, &loaded.schema, &known);
    report(&sources, &found, common.format)?;
    let query = query.ok_or(Failure::Input)?;
    let rows = query.run(&graph, &values, budget).map_err(|error| {
        tell(format_args!("error: {error}"));
        Failure::Input
    })?;
    let columns = rows
        .columns
        .iter()
        .map(|name| rc_diagnostics::foreign::clean(name));
    let mut lines: Vec<Vec<String>> = vec![columns.collect()];
    for row in &rows.cells {
        lines.push(row.iter().map(|cell| cell.shown(&graph)).collect());
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
    Ok(())
}

pub(crate) fn import(file: &Path, out: &Path, format: Format) -> Result<(), Failure> {
    let mut sources = SourceMap::new();
    let ending = file.extension().and_then(|ending| ending.to_str());
    let (document, found) = match ending {
        Some("json") => {
            let common = Common {
                format,
                ..Common::default()
            };
            let loaded = loaded(file, &mut sources, &common)?;
            // The ids of edges are those that a graph gives them.
            let graph = loaded.document.kept(&loaded.schema, 1);
            let graph = graph.map_err(|error| {
                tell(format_args!("{}: {error}", file.display()));
                Failure::Input
            })?;
            let mut document = Document::of(&graph.snapshot());
            document.schema = Some("dsr.gdsl".to_owned());
            (document, Diagnostics::new())
        }
        Some("xml" | "urdf") => {
            let text = rc_files::read(file).map_err(|error| refused(file, &error))?;
            let source = sources.add(file, text);
            let (tree, found) = if ending == Some("urdf") {
                urdf::read(&sources, source)
            } else {
                let folders = Folders { search: &[] };
                innermodel_language::load(&mut sources, &folders, source)
            };
            (graph_exchange::innermodel::document(&tree), found)
        }
        _ => {
            let message = format!("{} is no .json, .xml or .urdf file", file.display());
            return Err(Failure::Usage(message));
        }
    };
    report(&sources, &found, format)?;
    create(out, graph_json::write(&document).as_bytes(), "file", false)
}

pub(crate) fn export(request: &Request<'_>) -> Result<(), Failure> {
    let file = request.file;
    let mut sources = SourceMap::new();
    let loaded = loaded(file, &mut sources, request.common)?;
    let (text, ending) = if matches!(request.target, Target::Dsr) {
        let (text, lost) = dsr::write(&loaded.document);
        for lost in lost {
            tell(format_args!("warning: {lost}"));
        }
        (text, "json")
    } else {
        (graphml::write(&loaded.document), "graphml")
    };
    let name = file.file_stem().unwrap_or_default().to_string_lossy();
    let path = request.out.join(format!("{name}.{ending}"));
    create(&path, text.as_bytes(), "folder", request.dry_run)
}
