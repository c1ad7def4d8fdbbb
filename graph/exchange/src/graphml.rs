//! `GraphML` out, for other tools.

use crate::document::{Attribute, Document, Edge};
use property_graph::{Id, Value};
use rc_diagnostics::xml::escaped;
use std::collections::{BTreeMap, BTreeSet};

/// The type in `GraphML`, and the text of a value. Arrays and bytes are texts.
fn typed(value: &Value) -> (&'static str, String) {
    match value {
        Value::Bool(yes) => ("boolean", yes.to_string()),
        Value::Int(number) => ("long", number.to_string()),
        Value::Float(number) => ("double", number.to_string()),
        Value::Text(text) => ("string", text.to_string()),
        Value::Bytes(bytes) => {
            let digits = bytes.iter().map(|byte| format!("{byte:02x}"));
            ("string", digits.collect())
        }
        Value::Ints(all) => ("string", format!("{all:?}")),
        Value::Floats(all) => ("string", format!("{all:?}")),
        Value::Texts(all) => ("string", format!("{all:?}")),
        Value::Sample(sample) => {
            let text = format!("{} {} {}", sample.topic, sample.kind, sample.sequence);
            ("string", text)
        }
    }
}

/// Prints a document as `GraphML`. An edge that others refer to is also a node with its id and type. Nodes and edges have their type as the attribute `type`.
pub fn write(document: &Document) -> String {
    // A key for each name and type: one attribute may have several types in an open domain.
    let mut keys: BTreeMap<(&str, &str, &'static str), usize> = BTreeMap::new();
    let nodes = document.nodes.iter().map(|node| ("node", &node.attributes));
    let edges = document.edges.iter().map(|edge| ("edge", &edge.attributes));
    for (of, attributes) in nodes.chain(edges) {
        for (name, value, _) in attributes {
            let count = keys.len();
            keys.entry((of, name, typed(value).0)).or_insert(count);
        }
    }
    let mut out = String::from(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<graphml xmlns=\"http://graphml.graphdrawing.org/xmlns\">\n",
    );
    out.push_str(
        "  <key id=\"node_type\" for=\"node\" attr.name=\"type\" attr.type=\"string\"/>\n",
    );
    out.push_str(
        "  <key id=\"edge_type\" for=\"edge\" attr.name=\"type\" attr.type=\"string\"/>\n",
    );
    for ((of, name, kind), number) in &keys {
        let name = escaped(name);
        out.push_str(&format!(
            "  <key id=\"k{number}\" for=\"{of}\" attr.name=\"{name}\" attr.type=\"{kind}\"/>\n"
        ));
    }
    out.push_str("  <graph edgedefault=\"directed\">\n");
    let data = |of: &str, all: &[Attribute]| -> String {
        let lines = all.iter().map(|(name, value, _)| {
            let (kind, text) = typed(value);
            let key = keys
                .get(&(of, name.as_str(), kind))
                .copied()
                .unwrap_or_default();
            format!("      <data key=\"k{key}\">{}</data>\n", escaped(&text))
        });
        lines.collect()
    };
    for node in &document.nodes {
        out.push_str(&format!(
            "    <node id=\"n{}\">\n      <data key=\"node_type\">{}</data>\n{}    </node>\n",
            node.id.0,
            escaped(&node.kind),
            data("node", &node.attributes)
        ));
    }
    // GraphML has no edges to edges: one that others refer to is also a node of its own.
    let ends: BTreeSet<Id> = document.edges.iter().flat_map(|e| [e.from, e.to]).collect();
    let is_end = |edge: &&Edge| edge.id.is_some_and(|id| ends.contains(&id));
    for edge in document.edges.iter().filter(is_end) {
        out.push_str(&format!(
            "    <node id=\"n{}\">\n      <data key=\"node_type\">{}</data>\n    </node>\n",
            edge.id.unwrap_or_default().0,
            escaped(&edge.kind)
        ));
    }
    for edge in &document.edges {
        out.push_str(&format!(
            "    <edge source=\"n{}\" target=\"n{}\">\n      <data key=\"edge_type\">{}</data>\n{}    </edge>\n",
            edge.from.0,
            edge.to.0,
            escaped(&edge.kind),
            data("edge", &edge.attributes)
        ));
    }
    out.push_str("  </graph>\n</graphml>\n");
    out
}
