//! The picture of a graph: a box for each node, a row for each relation that starts there.

use crate::{Box, Picture, Row, short};
use graph_exchange::{Attribute, Document, Edge, Node, graph_json};
use property_graph::Id;
use rc_diagnostics::foreign;
use std::collections::{BTreeMap, HashMap, HashSet};

/// The picture of a graph. An edge at which others start or end has a box of its own between the
/// boxes of its ends. An edge with an end that does not exist is left out.
pub fn of_graph(document: &Document, title: &str) -> Picture {
    let ends: HashSet<Id> = document.edges.iter().flat_map(|e| [e.from, e.to]).collect();
    let is_end = |edge: &&Edge| edge.id.is_some_and(|id| ends.contains(&id));
    let promoted: Vec<&Edge> = document.edges.iter().filter(is_end).collect();
    let nodes = document.nodes.iter().map(|node| Some(node.id));
    let boxed = nodes.chain(promoted.iter().map(|edge| edge.id));
    let all = Boxes {
        names: document
            .nodes
            .iter()
            .map(|node| (node.id, name(node)))
            .collect(),
        places: boxed
            .flatten()
            .enumerate()
            .map(|(at, id)| (id, at))
            .collect(),
    };
    let mut leaving: HashMap<Id, BTreeMap<&str, Vec<&Edge>>> = HashMap::new();
    for edge in &document.edges {
        let of_node = leaving.entry(edge.from).or_default();
        of_node.entry(edge.kind.as_str()).or_default().push(edge);
    }
    let rows = |id: Id| -> Vec<Row> {
        let relations = leaving.get(&id).into_iter().flatten();
        relations
            .map(|(kind, edges)| all.row(id, kind, edges))
            .collect()
    };
    let nodes = document.nodes.iter().map(|node| Box {
        name: short(&all.name(node.id)),
        kind: short(&node.kind),
        tooltip: tooltip(&node.kind, node.id, &node.attributes),
        rows: rows(node.id),
    });
    let edges = promoted.iter().filter_map(|edge| {
        let id = edge.id?;
        let end = all.places.get(&edge.to);
        let to = Row {
            text: "→".to_owned(),
            ends: end.map(|at| (*at, all.title(edge))).into_iter().collect(),
            is_parent: false,
        };
        Some(Box {
            name: short(&edge.kind),
            kind: id_text(id),
            tooltip: tooltip(&edge.kind, id, &edge.attributes),
            rows: [to].into_iter().chain(rows(id)).collect(),
        })
    });
    Picture {
        title: foreign::clean(title),
        boxes: nodes.chain(edges).collect(),
    }
}

struct Boxes {
    names: HashMap<Id, String>,
    places: HashMap<Id, usize>,
}

impl Boxes {
    fn name(&self, id: Id) -> String {
        self.names.get(&id).cloned().unwrap_or_else(|| id_text(id))
    }

    /// The tooltip of an edge.
    fn title(&self, edge: &Edge) -> String {
        let title = format!(
            "{} {} {}",
            self.name(edge.from),
            edge.kind,
            self.name(edge.to)
        );
        let lines = attributes(&edge.attributes);
        [vec![foreign::clean(&title)], lines].concat().join("\n")
    }

    /// The edges of a relation that start at a node.
    fn row(&self, from: Id, kind: &str, edges: &[&Edge]) -> Row {
        let ends = edges.iter().filter(|edge| edge.to != from);
        let ends = ends.filter_map(|edge| {
            let own = edge.id.and_then(|id| self.places.get(&id));
            let end = own.or_else(|| self.places.get(&edge.to))?;
            Some((*end, self.title(edge)))
        });
        let is_at_itself = edges.iter().any(|edge| edge.to == from);
        let sign = if is_at_itself { "↺ " } else { "" };
        Row {
            text: format!("{sign}{}", short(kind)),
            ends: ends.collect(),
            is_parent: false,
        }
    }
}

fn tooltip(kind: &str, id: Id, all: &[Attribute]) -> Vec<String> {
    let first = foreign::clean(&format!("{kind} {}", id_text(id)));
    [first].into_iter().chain(attributes(all)).collect()
}

/// The name of a node, or its id.
fn name(node: &Node) -> String {
    let mut attributes = node.attributes.iter();
    let named = attributes.find_map(|(name, value, _)| {
        let text = value.as_str().filter(|text| !text.is_empty());
        text.filter(|_| name == "name")
    });
    named.map_or_else(|| id_text(node.id), str::to_owned)
}

fn id_text(id: Id) -> String {
    format!("{}:{}", id.writer(), id.count())
}

/// How long a value in a tooltip is at most, in characters.
const LONGEST_VALUE: usize = 200;

fn attributes(all: &[Attribute]) -> Vec<String> {
    let lines = all.iter().map(|(name, value, unit)| {
        let text = graph_json::value_text(value);
        let mut text: String = text.chars().take(LONGEST_VALUE).collect();
        if text.chars().count() == LONGEST_VALUE {
            text.push('…');
        }
        let unit = unit
            .as_ref()
            .map_or(String::new(), |unit| format!(" {unit}"));
        foreign::clean(&format!("{name}: {text}{unit}"))
    });
    lines.collect()
}
