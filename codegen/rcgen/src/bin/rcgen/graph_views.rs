//! `rcgen view` and `rcgen graph` of graphs and their schemas.

use crate::command_line::Common;
use crate::graphs::loaded;
use crate::reports::{Failure, print, refused, report};
use graph_drawing::Picture;
use graph_exchange::{Attribute, Document, Id, graph_json};
use graph_language::{Schema, model};
use rc_codegen::FileLoader;
use rc_diagnostics::{Diagnostics, SourceMap};
use rcgen::graphs::load_schema;
use serde_json::{Map, Value, json};
use std::path::Path;

/// Whether a file is a graph or a schema.
pub(crate) fn is_graph(file: &Path) -> bool {
    let ending = file.extension().and_then(|ending| ending.to_str());
    matches!(ending, Some("graph" | "json" | "gdsl"))
}

fn is_schema(file: &Path) -> bool {
    file.extension().is_some_and(|ending| ending == "gdsl")
}

/// Reads a schema, and reports its errors.
fn schema(file: &Path, common: &Common) -> Result<Schema, Failure> {
    let mut sources = SourceMap::new();
    let mut found = Diagnostics::new();
    let loader = FileLoader::new(&common.include);
    let loaded = load_schema(file, &mut sources, &loader, &mut found);
    let loaded = loaded.map_err(|error| refused(file, &error))?;
    report(&sources, &found, common.format)?;
    loaded.map(|(schema, _)| schema).ok_or(Failure::Input)
}

/// The picture of a graph or a schema.
pub(crate) fn picture(file: &Path, common: &Common) -> Result<Picture, Failure> {
    if is_schema(file) {
        return Ok(graph_drawing::of_schema(&schema(file, common)?));
    }
    let loaded = loaded(file, &mut SourceMap::new(), common)?;
    let name = file.file_stem().unwrap_or_default().to_string_lossy();
    Ok(graph_drawing::of_graph(&loaded.document, &name))
}

/// Prints a graph or a schema as JSON.
pub(crate) fn view(file: &Path, common: &Common) -> Result<(), Failure> {
    let all = if is_schema(file) {
        schema_view(&schema(file, common)?)
    } else {
        let loaded = loaded(file, &mut SourceMap::new(), common)?;
        graph_view(&loaded.document, &loaded.schema)
    };
    let text = serde_json::to_string_pretty(&all);
    let text = text.map_err(|error| Failure::System(error.to_string()))?;
    print(&(text + "\n"));
    Ok(())
}

/// A graph with what its schema says about each element.
fn graph_view(document: &Document, schema: &Schema) -> Value {
    let id_text = |id: Id| format!("{}:{}", id.writer(), id.count());
    let nodes = document.nodes.iter().map(|node| {
        let declared = schema.entity(&node.kind);
        let of = declared.map_or(&[][..], |entity| &entity.attributes);
        json!({
            "id": id_text(node.id),
            "type": node.kind,
            "types": schema.ancestry(&node.kind).collect::<Vec<_>>(),
            "domain": declared.map(|entity| &entity.domain),
            "attributes": values(&node.attributes, of),
        })
    });
    let edges = document.edges.iter().map(|edge| {
        let declared = schema.relation(&edge.kind);
        let of = declared.map_or(&[][..], |relation| &relation.attributes);
        json!({
            "id": edge.id.map(id_text),
            "type": edge.kind,
            "domain": declared.map(|relation| &relation.domain),
            "from": id_text(edge.from),
            "to": id_text(edge.to),
            "attributes": values(&edge.attributes, of),
        })
    });
    json!({
        "nodes": nodes.collect::<Vec<_>>(),
        "edges": edges.collect::<Vec<_>>(),
        "schema": schema_view(schema),
    })
}

/// Values with their units: those of the file, or else those of the schema.
fn values(all: &[Attribute], declared: &[model::Attribute]) -> Map<String, Value> {
    let values = all.iter().map(|(name, value, unit)| {
        let declared = declared.iter().find(|attribute| attribute.name == *name);
        let unit = unit
            .as_ref()
            .map(String::as_str)
            .or(declared.and_then(model::Attribute::common_unit));
        // A value has one form in JSON, here and in files.
        let value: Value = serde_json::from_str(&graph_json::value_text(value)).unwrap_or_default();
        (name.clone(), json!({ "value": value, "unit": unit }))
    });
    values.collect()
}

/// The numbers of an attribute with a data prototype.
fn block(kind: &model::Kind) -> Option<Value> {
    let model::Kind::Block(block) = kind else {
        return None;
    };
    let numbers = block.numbers.iter().map(
        |number| json!({ "name": number.name, "unit": number.unit, "type": number.number.word() }),
    );
    let conversions = block.conversions.iter().map(|conversion| &conversion.to);
    Some(json!({
        "prototype": block.prototype,
        "meaning": block.meaning,
        "numbers": numbers.collect::<Vec<_>>(),
        "sequence": block.is_sequence,
        "consistency": block.consistent_with,
        "converts_into": conversions.collect::<Vec<_>>(),
    }))
}

fn schema_view(schema: &Schema) -> Value {
    // JSON has no infinity: a missing end of a range has no number.
    let end = |end: f64| end.is_finite().then_some(end);
    let attributes = |all: &[model::Attribute]| -> Vec<Value> {
        let all = all.iter().map(|attribute| {
            json!({
                "name": attribute.name,
                "type": attribute.kind.text(),
                "unit": attribute.unit,
                "least": attribute.range.and_then(|range| end(range.0)),
                "greatest": attribute.range.and_then(|range| end(range.1)),
                "optional": attribute.optional,
                "key": attribute.key,
                "history": attribute.history.map(|history| history.as_secs_f64()),
                "block": block(&attribute.kind),
                "doc": attribute.doc,
            })
        });
        all.collect()
    };
    let entities = schema.entities.iter().map(|entity| {
        json!({
            "name": entity.name,
            "domain": entity.domain,
            "parent": entity.parent,
            "attributes": attributes(&entity.attributes),
            "doc": entity.doc,
        })
    });
    let relations = schema.relations.iter().map(|relation| {
        let ports = relation.ports.iter().map(|port| {
            json!({
                "name": port.name,
                "entity": port.entity,
                "least": port.min,
                "most": port.max,
            })
        });
        let child = |child: usize| relation.ports.get(child).map(|port| &port.name);
        let placed = relation.placed().map(|placed| {
            let attributes = match placed.pose {
                model::PoseOf::One(pose) => vec![pose],
                model::PoseOf::Two(by, angles) => vec![by, angles],
            };
            json!({ "child": child(placed.child), "attributes": attributes })
        });
        json!({
            "name": relation.name,
            "domain": relation.domain,
            "ports": ports.collect::<Vec<_>>(),
            "attributes": attributes(&relation.attributes),
            "tree": relation.tree.as_ref().map(|tree| child(tree.child)),
            "pose": placed,
            "doc": relation.doc,
        })
    });
    let rules = schema.rules.iter().map(|rule| {
        let relation = schema.relation(&rule.relation);
        let side = |(port, attribute): &(usize, String)| {
            let port = relation.and_then(|relation| relation.ports.get(*port));
            json!({ "port": port.map(|port| &port.name), "attribute": attribute })
        };
        json!({
            "relation": rule.relation,
            "left": side(&rule.left),
            "comparison": rule.comparison.text(),
            "right": side(&rule.right),
            "message": rule.message,
        })
    });
    let queries = schema.queries.iter().map(|query| {
        let parameters = query.parameters.iter();
        let parameters = parameters.map(|(name, kind)| json!({ "name": name, "type": kind }));
        json!({
            "name": query.name,
            "parameters": parameters.collect::<Vec<_>>(),
            "text": query.text,
        })
    });
    json!({
        "name": schema.name,
        "open": schema.open,
        "entities": entities.collect::<Vec<_>>(),
        "relations": relations.collect::<Vec<_>>(),
        "rules": rules.collect::<Vec<_>>(),
        "queries": queries.collect::<Vec<_>>(),
    })
}
