//! A graph under another schema than that with which it was made.

use crate::{Attribute, Document, check, graph_json};
use graph_schema::{Difference, Schema};
use property_graph::{Graph, Snapshot};
use rc_diagnostics::{Format, SourceMap, render};
use std::sync::Arc;

/// What became of a graph that was taken over into another schema.
#[derive(Debug)]
pub struct Migration {
    /// What the schemas declare differently, whether the graph has any of it or not.
    pub differences: Vec<Difference>,
    /// What does not fit the new schema, a line each. Places are those in the text that
    /// [`graph_json::write`] makes of the graph.
    pub findings: Vec<String>,
    /// The graph with the new schema. `None` if an element does not fit: nothing is left out.
    pub graph: Option<Graph>,
}

/// Takes a version of a graph over into another schema. Elements keep their ids; the past of the graph
/// stays with the old one. New ids have the number of `writer`.
pub fn migrate(before: &Snapshot, schema: &Arc<Schema>, writer: u64) -> Migration {
    let mut document = Document::of(before);
    add_units(&mut document, before.schema());
    let mut sources = SourceMap::new();
    let source = sources.add("graph", graph_json::write(&document));
    // Only what was read knows its places.
    let (read, mut found) = graph_json::read(&sources, source);
    let document = read.unwrap_or(document);
    found.extend(check(&document, schema, &sources, source));
    let findings = render(&sources, &found, Format::Short);
    let mut findings: Vec<String> = findings.lines().map(str::to_owned).collect();
    let mut graph = None;
    if !found.has_errors() {
        match document.graph(Arc::clone(schema), writer) {
            Ok(made) => graph = Some(made),
            Err(error) => findings.push(error.to_string()),
        }
    }
    Migration {
        differences: before.schema().differences(schema),
        findings,
        graph,
    }
}

/// Says the unit of each value, so that the same number in another unit is a finding.
fn add_units(document: &mut Document, schema: &Schema) {
    let add = |attributes: &mut [Attribute], declared: &[graph_schema::Attribute]| {
        for (name, _, unit) in attributes {
            let declared = declared.iter().find(|attribute| attribute.name == *name);
            *unit = declared.and_then(|attribute| attribute.unit.clone());
        }
    };
    for node in &mut document.nodes {
        if let Some(entity) = schema.entity(&node.kind) {
            add(&mut node.attributes, &entity.attributes);
        }
    }
    for edge in &mut document.edges {
        if let Some(relation) = schema.relation(&edge.kind) {
            add(&mut edge.attributes, &relation.attributes);
        }
    }
}
