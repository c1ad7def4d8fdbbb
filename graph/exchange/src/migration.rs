//! A graph under another schema than that with which it was made.

use crate::{Attribute, Document, check, graph_json};
use graph_schema::{Block, Difference, Kind, Schema};
use property_graph::{Graph, Snapshot};
use rc_diagnostics::{Format, SourceMap, render};
use std::collections::BTreeSet;
use std::sync::Arc;

/// The result of converting a graph to another schema.
#[derive(Debug)]
pub struct Migration {
    /// The different declarations of the schemas, whether the graph uses them or not.
    pub differences: Vec<Difference>,
    /// Elements that do not fit the new schema, a line each. Places are those in the text that
    /// [`graph_json::write`] makes of the graph.
    pub findings: Vec<String>,
    /// The graph with the new schema. `None` if an element does not fit: nothing is left out.
    pub graph: Option<Graph>,
}

/// Takes a version of a graph over into another schema. Elements keep their ids; the past of the
/// graph stays with the old one. New ids have the number of `writer`.
pub fn migrate(before: &Snapshot, schema: &Arc<Schema>, writer: u64) -> Migration {
    let mut document = Document::of(before);
    add_units(&mut document, before.schema());
    let mut sources = SourceMap::new();
    let source = sources.add("graph", graph_json::write(&document));
    // Places are known only for a text that was read.
    let (read, mut found) = graph_json::read(&sources, source);
    let document = read.unwrap_or(document);
    found.extend(check(&document, schema, &sources, source));
    let findings = render(&sources, &found, Format::Short);
    let mut findings: Vec<String> = findings.lines().map(str::to_owned).collect();
    let mut graph = None;
    let changed = other_blocks(&document, before.schema(), schema);
    let is_changed = !changed.is_empty();
    findings.extend(changed);
    if !found.has_errors() && !is_changed {
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

/// Blocks that are there and whose numbers mean something else in the new schema, though they may
/// fit: each type with its attribute once.
fn other_blocks(document: &Document, old: &Schema, new: &Schema) -> BTreeSet<String> {
    let nodes = document.nodes.iter();
    let nodes = nodes.map(|node| (node.kind.as_str(), &node.attributes));
    let edges = document.edges.iter();
    let edges = edges.map(|edge| (edge.kind.as_str(), &edge.attributes));
    let mut seen = BTreeSet::new();
    let mut found = BTreeSet::new();
    for (kind, attributes) in nodes.chain(edges) {
        for (name, ..) in attributes {
            if !seen.insert((kind, name)) {
                continue;
            }
            let block = |schema: &Schema| {
                let entity = schema.entity(kind).map(|entity| &entity.attributes);
                let all = entity.or_else(|| schema.relation(kind).map(|r| &r.attributes))?;
                let attribute = all.iter().find(|attribute| attribute.name == *name)?;
                match &attribute.kind {
                    Kind::Block(block) => Some(Arc::clone(block)),
                    _ => None,
                }
            };
            let (old, new) = (block(old), block(new));
            let meaning = |block: &Option<Arc<Block>>| {
                let block = block.as_ref();
                block.map(|b| (b.meaning.clone(), b.numbers.clone(), b.is_sequence))
            };
            if meaning(&old) != meaning(&new) {
                let text = |block: Option<Arc<Block>>| {
                    block.map_or("no data prototype".to_owned(), |block| {
                        block.meaning.clone()
                    })
                };
                found.insert(format!(
                    "`{name}` of `{kind}` is {} in the graph, and {} in the new schema",
                    text(old),
                    text(new)
                ));
            }
        }
    }
    found
}

/// Says the unit of each value, so that the same number in another unit is a finding.
fn add_units(document: &mut Document, schema: &Schema) {
    let add = |attributes: &mut [Attribute], declared: &[graph_schema::Attribute]| {
        for (name, _, unit) in attributes {
            let declared = declared.iter().find(|attribute| attribute.name == *name);
            let declared = declared.and_then(|attribute| attribute.common_unit());
            *unit = declared.map(str::to_owned);
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
