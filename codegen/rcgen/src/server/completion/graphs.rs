//! Suggestions in files of graphs, by their schema.

use super::{Completion, Item, PROPERTY, STRUCT, Target, VALUE, units, words};
use crate::server::json_place::{Json, JsonPlace, read};
use graph_language::Schema;
use graph_language::model::{Attribute, Kind};
use rc_diagnostics::{SourceMap, Span};
use rc_syntax::Name;

/// The members of a file, of a node and of an edge.
const FILE: [(&str, &str); 3] = [
    ("schema", "The file of the schema."),
    ("nodes", "The nodes."),
    ("edges", "The edges."),
];
const NODE: [(&str, &str); 3] = [
    ("id", "Writer and number: `1:42`."),
    ("type", "An entity of the schema."),
    ("attributes", "Names and values."),
];
const EDGE: [(&str, &str); 5] = [
    ("id", "Writer and number: `1:42`."),
    ("type", "A relation of the schema."),
    ("from", "The id of a node."),
    ("to", "The id of a node."),
    ("attributes", "Names and values."),
];

/// The start of the word at the cursor, and what is allowed there.
pub(super) fn in_graph(
    completion: &Completion<'_>,
    target: &Target<'_>,
    cursor: usize,
) -> Option<(usize, Vec<Item>)> {
    let Json {
        place,
        listed,
        outermost,
    } = read(target.text, cursor);
    let place = place?;
    let named = outermost.iter().find(|(key, _)| *key == "schema");
    let schema = named.and_then(|(_, file)| schema(completion, target, file));
    let written = &target.text[place.start..cursor];
    let mut items = match (place.keys.as_slice(), place.is_key) {
        ([], true) => keys(&FILE, &place),
        (["nodes"], true) => keys(&NODE, &place),
        (["edges"], true) => keys(&EDGE, &place),
        (["schema"], false) if place.is_string => completion.importable(target, written, "gdsl"),
        (["nodes", "type"], false) => {
            let all = schema.iter().flat_map(|schema| &schema.entities);
            all.map(|entity| Item::new(STRUCT, entity.name.as_str(), entity.doc.join("\n")))
                .collect()
        }
        (["edges", "type"], false) => {
            let all = schema.iter().flat_map(|schema| &schema.relations);
            all.map(|relation| {
                let ends = relation.ports.iter();
                let ends = ends.map(|port| format!("{} {}", port.name, port.entity));
                let doc = relation.doc.join("\n");
                let mut item = Item::new(STRUCT, relation.name.as_str(), doc);
                item.detail = ends.collect::<Vec<_>>().join(", ");
                item
            })
            .collect()
        }
        (["edges", end @ ("from" | "to")], false) => {
            let port = usize::from(*end == "to");
            let kind = member(&place, 0, "type");
            let wanted = schema
                .as_ref()
                .zip(kind)
                .and_then(|(schema, kind)| Some((schema, schema.relation(kind)?.ports.get(port)?)));
            let nodes = listed.iter().filter(|(list, _)| *list == "nodes");
            let nodes = nodes.filter_map(|(_, members)| {
                let member = |name: &str| members.iter().find(|(key, _)| *key == name);
                let kind = member("type").map_or("", |(_, kind)| kind);
                let fits = wanted.is_none_or(|(schema, port)| schema.is_a(kind, &port.entity));
                let id = member("id").filter(|_| fits)?.1;
                Some(Item::new(
                    VALUE,
                    id,
                    format!("A node of the type `{kind}`."),
                ))
            });
            nodes.collect()
        }
        (["nodes" | "edges", "attributes"], true) => {
            let all = attributes(schema.as_ref(), member(&place, 1, "type"));
            let written = place.members.last();
            let is_free =
                |name: &str| written.is_none_or(|all| all.iter().all(|(key, _)| *key != name));
            let all = all.iter().filter(|attribute| is_free(&attribute.name));
            all.map(|attribute| {
                let mut item = Item::new(PROPERTY, attribute.name.as_str(), doc(attribute));
                item.detail = attribute.kind.text();
                item
            })
            .collect()
        }
        (["nodes" | "edges", "attributes", name], false) => {
            let all = attributes(schema.as_ref(), member(&place, 1, "type"));
            let found = all.iter().find(|attribute| attribute.name == *name);
            match found.map(|attribute| &attribute.kind) {
                Some(Kind::Enum(all)) => words(all.iter().map(String::as_str), "A value."),
                Some(Kind::Bool) if !place.is_string => {
                    let all = words(["true", "false"], "A value.");
                    return Some((place.start, all));
                }
                _ => Vec::new(),
            }
        }
        (["nodes" | "edges", "attributes", _, "unit"], false) => units(),
        _ => Vec::new(),
    };
    if !place.is_string {
        for item in &mut items {
            item.label = format!("\"{}\"", item.label);
        }
    }
    Some((place.start, items))
}

/// The schema that a file names, if it can be read.
fn schema(completion: &Completion<'_>, target: &Target<'_>, file: &str) -> Option<Schema> {
    let mut sources = SourceMap::new();
    let source = sources.add(target.path, target.text);
    let name = Name::new(file, Span::new(source, 0, 0));
    let loader = completion.files.loader();
    graph_language::import(&mut sources, &loader, target.path, &name).0
}

/// Keys that an object does not have.
fn keys(all: &[(&'static str, &'static str)], place: &JsonPlace<'_>) -> Vec<Item> {
    let written = place.members.last().map_or(&[][..], Vec::as_slice);
    let free = all
        .iter()
        .filter(|(key, _)| written.iter().all(|(known, _)| known != key));
    free.map(|(key, meaning)| Item::new(PROPERTY, *key, *meaning))
        .collect()
}

/// The text of a member before the cursor: of its object, or of one that many objects above.
fn member<'a>(place: &JsonPlace<'a>, above: usize, name: &str) -> Option<&'a str> {
    let object = place.members.iter().rev().nth(above)?;
    let found = object.iter().find(|(key, _)| *key == name);
    found.map(|(_, text)| *text)
}

/// The attributes of a type.
fn attributes<'s>(schema: Option<&'s Schema>, kind: Option<&str>) -> &'s [Attribute] {
    let found = schema.zip(kind);
    found
        .and_then(|(schema, kind)| schema.attributes(kind))
        .unwrap_or_default()
}

/// The documentation of an attribute, with its unit and range.
fn doc(attribute: &Attribute) -> String {
    let mut lines = attribute.doc.clone();
    lines.extend(attribute.common_unit().map(|unit| format!("Unit: {unit}.")));
    let range = attribute.range.as_ref();
    lines.extend(range.map(|(least, most)| format!("From {least} to {most}.")));
    if attribute.optional {
        lines.push("Optional.".to_owned());
    }
    lines.join("\n")
}
