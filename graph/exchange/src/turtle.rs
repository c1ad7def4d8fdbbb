//! RDF out, as Turtle: a graph, and its schema as shapes of SHACL, for tools of the semantic web.
//!
//! Each node and each edge is a resource of its type, also an edge, because an edge has attributes and may
//! be an end of others: its ports lead to its ends. Names of members include the type that declares them. A
//! list has its numbers in their order.

use crate::document::{Attribute, Document};
use base64::Engine as _;
use graph_schema::{Kind, Schema, is_same_unit};
use property_graph::{Id, Value};
use std::collections::BTreeSet;
use std::fmt::Write as _;

pub(crate) const PREFIXES: &str = "\
@prefix rc: <urn:robocomp:graph#> .
@prefix rdf: <http://www.w3.org/1999/02/22-rdf-syntax-ns#> .
@prefix rdfs: <http://www.w3.org/2000/01/rdf-schema#> .
@prefix sh: <http://www.w3.org/ns/shacl#> .
@prefix xsd: <http://www.w3.org/2001/XMLSchema#> .
";

/// A name as a part of an IRI.
fn encoded(name: &str) -> String {
    let mut out = String::with_capacity(name.len());
    for byte in name.bytes() {
        match byte {
            b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'_' | b'-' => out.push(byte.into()),
            _ => {
                let _ = write!(out, "%{byte:02X}");
            }
        }
    }
    out
}

/// A type.
pub(crate) fn class(schema: &Schema, kind: &str) -> String {
    let domain = encoded(schema.domain(kind));
    format!("<urn:robocomp:domain:{domain}#{}>", encoded(kind))
}

/// An attribute or a port of a type, by the name of the type that declares it. The attributes of an entity
/// that a relation promotes are those of the entity.
pub(crate) fn member(schema: &Schema, kind: &str, name: &str) -> String {
    let has = |above: &&str| {
        let entity = schema.entity(above);
        entity.is_some_and(|entity| entity.attribute(name).is_some())
    };
    let above = schema.ancestry(kind).skip(1).take_while(has);
    let class = class(schema, above.last().unwrap_or(kind));
    format!("{}.{}>", class.trim_end_matches('>'), encoded(name))
}

fn resource(id: Id) -> String {
    format!("<urn:robocomp:element:{}:{}>", id.writer(), id.count())
}

/// A text as a literal.
pub(crate) fn quoted(text: &str) -> String {
    let mut out = String::from("\"");
    for c in text.chars() {
        match c {
            '"' => out.push_str("\\\""),
            '\\' => out.push_str("\\\\"),
            c if c.is_control() => {
                let _ = write!(out, "\\u{:04X}", u32::from(c));
            }
            c => out.push(c),
        }
    }
    out.push('"');
    out
}

fn list(items: impl Iterator<Item = String>) -> String {
    let items: Vec<String> = items.collect();
    format!("( {} )", items.join(" "))
}

/// A value. Integers are floats where the schema says so, as in a graph.
fn value(value: &Value, kind: Option<&Kind>) -> String {
    let are_floats = matches!(kind, Some(Kind::Float | Kind::Floats(_) | Kind::Block(_)));
    let integer = |number: &i64| {
        if are_floats {
            format!("{:e}", *number as f64)
        } else {
            number.to_string()
        }
    };
    match value {
        Value::Bool(yes) => yes.to_string(),
        Value::Int(number) => integer(number),
        Value::Float(number) => format!("{number:e}"),
        Value::Text(text) => quoted(text),
        Value::Bytes(bytes) => {
            let text = base64::engine::general_purpose::STANDARD.encode(bytes);
            format!("\"{text}\"^^xsd:base64Binary")
        }
        Value::Ints(all) => list(all.iter().map(integer)),
        Value::Floats(all) => list(all.iter().map(|number| format!("{number:e}"))),
        Value::Texts(all) => list(all.iter().map(|text| quoted(text))),
        Value::Sample(sample) => format!(
            "[ rc:topic {} ; rc:sampleType {} ; rc:sequence {} ]",
            quoted(&sample.topic),
            quoted(&sample.kind),
            sample.sequence
        ),
    }
}

/// Prints a document. A value whose unit is not that of the schema is a resource with its unit.
pub fn write(document: &Document, schema: &Schema) -> String {
    let mut out = PREFIXES.to_owned();
    let mut kinds: BTreeSet<&str> = BTreeSet::new();
    out.push('\n');
    for node in &document.nodes {
        kinds.insert(&node.kind);
        let declared = schema.entity(&node.kind).map(|entity| &*entity.attributes);
        let values = values(schema, &node.kind, &node.attributes, declared);
        let class = class(schema, &node.kind);
        let _ = writeln!(out, "{} a {class}{values} .", resource(node.id));
    }
    for (at, edge) in document.edges.iter().enumerate() {
        kinds.insert(&edge.kind);
        let relation = schema.relation(&edge.kind);
        let declared = relation.map(|relation| &*relation.attributes);
        let values = values(schema, &edge.kind, &edge.attributes, declared);
        // Files of DSR give edges no ids.
        let own = edge.id.map_or_else(|| format!("_:e{at}"), resource);
        let class = class(schema, &edge.kind);
        let [from, to] = [0, 1].map(|at| {
            let port = relation.and_then(|relation| relation.ports.get(at));
            match port {
                Some(port) => member(schema, &edge.kind, &port.name),
                None => ["rc:from", "rc:to"][at].to_owned(),
            }
        });
        let (start, end) = (resource(edge.from), resource(edge.to));
        let _ = writeln!(
            out,
            "{own} a {class} ;\n    {from} {start} ;\n    {to} {end}{values} ."
        );
    }
    out.push('\n');
    for kind in kinds {
        out.push_str(&ancestry(schema, kind));
    }
    out
}

/// The parent of a type. A type of edges is one of [`Schema::relations`].
fn ancestry(schema: &Schema, kind: &str) -> String {
    let mut out = String::new();
    let all: Vec<&str> = schema.ancestry(kind).collect();
    for pair in all.windows(2) {
        let (own, above) = (class(schema, pair[0]), class(schema, pair[1]));
        let _ = writeln!(out, "{own} rdfs:subClassOf {above} .");
    }
    if schema.relation(kind).is_some() {
        let _ = writeln!(out, "{} rdfs:subClassOf rc:Edge .", class(schema, kind));
    }
    out
}

fn values(
    schema: &Schema,
    kind: &str,
    all: &[Attribute],
    declared: Option<&[graph_schema::Attribute]>,
) -> String {
    let mut out = String::new();
    for (name, given, unit) in all {
        let attribute = declared.and_then(|all| all.iter().find(|own| own.name == *name));
        let mut text = value(given, attribute.map(|attribute| &attribute.kind));
        let common = attribute.and_then(graph_schema::Attribute::common_unit);
        if let Some(unit) = unit
            && !common.is_some_and(|common| is_same_unit(common, unit))
        {
            text = format!("[ rdf:value {text} ; rc:unit {} ]", quoted(unit));
        }
        let _ = write!(out, " ;\n    {} {text}", member(schema, kind, name));
    }
    out
}

/// The attributes that a type declares itself.
pub(crate) fn own<'s>(schema: &'s Schema, kind: &'s str) -> Vec<&'s graph_schema::Attribute> {
    let above = schema.ancestry(kind).nth(1);
    let above = above.and_then(|above| schema.entity(above));
    let inherited = |name: &str| above.is_some_and(|above| above.attribute(name).is_some());
    let all = schema.attributes(kind).unwrap_or_default().iter();
    all.filter(|own| !inherited(&own.name)).collect()
}
