//! The errors in a document, each finding at its place.

use crate::document::{self, Document, Edge, Node};
use crate::hints::{empty, thousandth};
use crate::places::{Places, SEPARATOR};
use graph_schema::{Attribute, Relation, Schema, compared_units, is_same_unit};
use property_graph::{Id, MOST_BYTES, Value, fits, in_order};
use rc_diagnostics::{Diagnostic, Diagnostics, Severity, SourceId, SourceMap, foreign, nearest};
use std::collections::{HashMap, HashSet};
use std::sync::Arc;

/// A loop closes if its ends are nearer than this, in the unit of its translations and in radians.
const CLOSED: f64 = 1e-6;

/// A finding whose place is not known yet.
struct Finding {
    severity: Severity,
    code: &'static str,
    path: String,
    message: String,
    help: Option<String>,
}

struct Checker<'a> {
    schema: &'a Schema,
    document: &'a Document,
    /// The nodes by id.
    nodes: HashMap<Id, &'a Node>,
    /// The edges by id: others may start and end there.
    edges: HashMap<Id, &'a Edge>,
    /// Where attributes are whose values could not be read, which is told.
    unread: HashSet<&'a str>,
    /// Attributes of nodes that rules compare.
    compared: HashMap<(Id, &'a str), f64>,
    findings: Vec<Finding>,
}

/// Compares a document with a schema. All findings are at their places in `source`.
pub fn check(
    document: &Document,
    schema: &Schema,
    sources: &SourceMap,
    source: SourceId,
) -> Diagnostics {
    let mut checker = Checker {
        schema,
        document,
        nodes: HashMap::with_capacity(document.nodes.len()),
        edges: HashMap::new(),
        unread: document.unread.iter().map(String::as_str).collect(),
        compared: compared(document, schema),
        findings: Vec::new(),
    };
    for node in &document.nodes {
        if checker.nodes.insert(node.id, node).is_some() {
            let message = format!("two nodes have the id {}", shown(node.id));
            checker.error("duplicate-id", &node.path, message);
        }
    }
    let mut ids: HashSet<Id> = checker.nodes.keys().copied().collect();
    for edge in &document.edges {
        if let Some(id) = edge.id.filter(|id| !ids.insert(*id)) {
            let message = format!("another element has the id {}", shown(id));
            checker.error("duplicate-id", &edge.path, message);
        }
    }
    let edges = document.edges.iter();
    checker.edges = edges.filter_map(|edge| Some((edge.id?, edge))).collect();
    for node in &document.nodes {
        checker.node(node);
    }
    for edge in &document.edges {
        checker.edge(edge);
    }
    checker.rounds();
    checker.ports();
    checker.keys();
    for relation in schema.relations.iter().filter(|r| r.tree.is_some()) {
        checker.tree(relation);
    }
    let has_errors = |found: &Finding| found.severity == Severity::Error;
    if !checker.findings.iter().any(has_errors) {
        checker.loops();
    }
    let mut found = Diagnostics::new();
    if !checker.findings.is_empty() {
        let places = Places::new(source, sources.text(source));
        for finding in checker.findings {
            let span = places.of(&finding.path);
            let mut diagnostic = match finding.severity {
                Severity::Error => Diagnostic::error(finding.code, span, finding.message),
                Severity::Warning | Severity::Note => {
                    Diagnostic::warning(finding.code, span, finding.message)
                }
            };
            if let Some(help) = finding.help {
                diagnostic = diagnostic.help(help);
            }
            found.push(diagnostic);
        }
    }
    found
}

/// The attributes of nodes, and of edges that are nodes to others, that rules compare. An attribute that
/// is there twice has its first value.
fn compared<'a>(document: &'a Document, schema: &Schema) -> HashMap<(Id, &'a str), f64> {
    let sides = schema.rules.iter().flat_map(|r| [&r.left.1, &r.right.1]);
    let names: HashSet<&str> = sides.map(String::as_str).collect();
    let mut all = HashMap::new();
    if names.is_empty() {
        return all;
    }
    let nodes = document.nodes.iter();
    let nodes = nodes.map(|node| (node.id, &node.attributes));
    let edges = document.edges.iter();
    let edges = edges.filter_map(|edge| Some((edge.id?, &edge.attributes)));
    for (id, attributes) in nodes.chain(edges) {
        for (name, value, _) in attributes {
            if names.contains(name.as_str())
                && let Some(number) = value.as_f64()
            {
                all.entry((id, name.as_str())).or_insert(number);
            }
        }
    }
    all
}

impl<'a> Checker<'a> {
    fn push(
        &mut self,
        severity: Severity,
        code: &'static str,
        path: &str,
        message: String,
        help: Option<String>,
    ) {
        self.findings.push(Finding {
            severity,
            code,
            path: path.to_owned(),
            message,
            help,
        });
    }

    fn error(&mut self, code: &'static str, path: &str, message: String) {
        self.push(Severity::Error, code, path, message, None);
    }

    /// Unknown types and attributes are errors in a strict domain, and kept in an open one.
    fn unknown(&mut self, code: &'static str, path: &str, message: String, near: Option<String>) {
        // A file without a schema cannot be compared with one.
        if self.schema.entities.is_empty() && self.schema.relations.is_empty() {
            return;
        }
        let severity = if self.schema.open {
            Severity::Warning
        } else {
            Severity::Error
        };
        let help = near.map(|near| format!("did you mean `{near}`?"));
        self.push(severity, code, path, message, help);
    }

    fn node(&mut self, node: &Node) {
        let kind = foreign::clean(&node.kind);
        let Some(entity) = self.schema.entity(&node.kind) else {
            let known = self.schema.entities.iter().map(|e| e.name.as_str());
            let near = nearest(&node.kind, known).map(str::to_owned);
            let message = format!("the schema has no entity `{kind}`");
            let path = format!("{}{SEPARATOR}type", node.path);
            self.unknown("unknown-type", &path, message, near);
            return;
        };
        self.attributes(&node.path, &node.attributes, &entity.attributes, &kind);
        if self.schema.name != "dsr" {
            return;
        }
        // DSR repeats the parent as an attribute.
        let parent = node.attributes.iter().find(|(name, ..)| name == "parent");
        if let Some(Value::Int(id)) = parent.map(|(_, value, _)| value)
            && *id != 0
            && !self.nodes.contains_key(&Id(*id as u128))
        {
            let path = path_of(&node.path, "attribute", "parent");
            let message = format!("`parent` is {id}, which is not a node");
            self.error("unknown-node", &path, message);
        }
    }

    fn attributes(
        &mut self,
        above: &str,
        all: &[document::Attribute],
        described: &[Attribute],
        kind: &str,
    ) {
        let member = if all_in_links(above) {
            "linkAttribute"
        } else {
            "attribute"
        };
        let mut seen: HashSet<&str> = HashSet::with_capacity(all.len());
        // Of attributes that are one value, the one that the file gives.
        let mut said: HashMap<&str, &str> = HashMap::new();
        for (name, value, unit) in all {
            let path = path_of(above, member, name);
            let shown = foreign::clean(name);
            if !seen.insert(name) {
                let message = format!("`{shown}` occurs twice");
                self.error("duplicate-member", &path, message);
            }
            let is_long =
                value.size() > MOST_BYTES && !matches!(value, Value::Text(_) | Value::Texts(_));
            if is_long {
                let message = format!(
                    "`{shown}` has {} bytes, expected {MOST_BYTES} at most",
                    value.size()
                );
                let help = "publish it on a topic, and refer to the sample: `topic` as the type, and \
                            `{\"topic\": …, \"type\": …, \"sequence\": …}` as the value";
                let help = Some(help.to_owned());
                self.push(Severity::Error, "wrong-value", &path, message, help);
            }
            let Some(attribute) = described.iter().find(|a| a.name == *name) else {
                let known = described.iter().map(|a| a.name.as_str());
                let near = nearest(name, known).map(str::to_owned);
                let message = format!("`{kind}` has no attribute `{shown}`");
                self.unknown("unknown-attribute", &path, message, near);
                continue;
            };
            if let Some(first) = said.insert(attribute.value_of(), name)
                && first != name
            {
                let message =
                    format!("`{shown}` and `{first}` are one value, which is given twice");
                let help = Some("write one of them; the other one is converted".to_owned());
                self.push(Severity::Error, "duplicate-member", &path, message, help);
            }
            let own = attribute.common_unit();
            if let Some(unit) = unit
                && !own.is_some_and(|own| is_same_unit(own, unit))
            {
                let expected = own.map_or("no unit".to_owned(), |own| format!("`{own}`"));
                let shown_unit = foreign::clean(unit);
                let message = format!("`{shown}` is in `{shown_unit}`, expected {expected}");
                let help = own.map(|own| compared_units(&shown_unit, own));
                self.push(Severity::Error, "unit-mismatch", &path, message, help);
                continue;
            }
            if !is_long && let Err((expected, found)) = fits(attribute, value) {
                let message = format!("`{shown}` of `{kind}` is {expected}, found {found}");
                let help = thousandth(attribute, value).or_else(|| empty(attribute, value));
                self.push(Severity::Error, "wrong-value", &path, message, help);
            }
        }
        for attribute in described.iter().filter(|a| !a.optional) {
            let is_there = || {
                let path = path_of(above, member, &attribute.name);
                self.unread.contains(path.as_str())
            };
            if !seen.contains(attribute.name.as_str())
                && !said.contains_key(&*attribute.name)
                && !is_there()
            {
                let message = format!(
                    "`{kind}` has no `{}`, which is not optional",
                    attribute.name
                );
                self.error("missing-value", above, message);
            }
        }
    }

    fn edge(&mut self, edge: &Edge) {
        let kind = foreign::clean(&edge.kind);
        let relation = self.schema.relation(&edge.kind);
        for (end, member) in [(edge.from, "from"), (edge.to, "to")] {
            if !self.nodes.contains_key(&end) && !self.edges.contains_key(&end) {
                let member = match (all_in_links(&edge.path), member) {
                    (true, "from") => "src",
                    (true, _) => "dst",
                    (false, member) => member,
                };
                let path = format!("{}{SEPARATOR}{member}", edge.path);
                let end = shown(end);
                let message = format!("an edge `{kind}` ends at {end}, which is not a node");
                self.error("unknown-node", &path, message);
            }
        }
        let Some(relation) = relation else {
            let known = self.schema.relations.iter().map(|r| r.name.as_str());
            let near = nearest(&edge.kind, known).map(str::to_owned);
            let message = format!("the schema has no relation `{kind}`");
            let member = if all_in_links(&edge.path) {
                "label"
            } else {
                "type"
            };
            let path = format!("{}{SEPARATOR}{member}", edge.path);
            self.unknown("unknown-type", &path, message, near);
            return;
        };
        self.attributes(&edge.path, &edge.attributes, &relation.attributes, &kind);
        for (port, end) in relation.ports.iter().zip([edge.from, edge.to]) {
            let Some(found) = self.kind_of(end) else {
                continue;
            };
            let schema = self.schema;
            let is_known = schema.entity(found).is_some() || schema.relation(found).is_some();
            if is_known && !schema.is_a(found, &port.entity) {
                let message = format!(
                    "port `{}` of `{kind}` is for {}, found {}",
                    port.name,
                    port.entity,
                    foreign::clean(found)
                );
                self.error("wrong-port", &edge.path, message);
            }
        }
        if relation.tree.is_some() && edge.from == edge.to {
            let message = format!(
                "an edge `{kind}` leads from node {} to itself",
                shown(edge.from)
            );
            self.error("edge-to-itself", &edge.path, message);
        }
        self.rules(edge, &kind);
    }

    /// The type of a node or an edge.
    fn kind_of(&self, id: Id) -> Option<&'a str> {
        let node = self.nodes.get(&id).map(|node| node.kind.as_str());
        node.or_else(|| self.edges.get(&id).map(|edge| edge.kind.as_str()))
    }

    /// Edges that start or end at themselves, over other edges.
    fn rounds(&mut self) {
        let edges = &self.document.edges;
        let ends = edges.iter().map(|edge| (edge.id, [edge.from, edge.to]));
        let ends: Vec<_> = ends.collect();
        // An end that does not exist is a finding of its own.
        let is_there = |id| self.nodes.contains_key(&id) || !self.edges.contains_key(&id);
        for at in in_order(&ends, is_there).1 {
            let edge = &edges[at];
            let kind = foreign::clean(&edge.kind);
            let message = format!("an edge `{kind}` leads to itself, over the edges at its ends");
            self.error("edge-to-itself", &edge.path, message);
        }
    }

    fn rules(&mut self, edge: &Edge, kind: &str) {
        for rule in self.schema.rules.iter().filter(|r| r.relation == edge.kind) {
            let number = |(port, name): &(usize, String)| {
                let node = *[edge.from, edge.to].get(*port)?;
                self.compared.get(&(node, name.as_str())).copied()
            };
            let (Some(a), Some(b)) = (number(&rule.left), number(&rule.right)) else {
                continue;
            };
            if !rule.comparison.holds(a, b) {
                let comparison = rule.comparison.text();
                let message = format!(
                    "{}: {a} {comparison} {b} does not hold for an edge of `{kind}`",
                    rule.message
                );
                self.error("broken-rule", &edge.path, message);
            }
        }
    }

    /// Counts the edges of each node at ports with a bound.
    fn ports(&mut self) {
        let mut counts: HashMap<(&str, usize, Id), u32> = HashMap::new();
        for edge in &self.document.edges {
            for (port, end) in [edge.from, edge.to].into_iter().enumerate() {
                *counts.entry((edge.kind.as_str(), port, end)).or_default() += 1;
            }
        }
        let mut wrong = Vec::new();
        for relation in &self.schema.relations {
            for (at, port) in relation.ports.iter().enumerate() {
                if port.min == 0 && port.max.is_none() {
                    continue;
                }
                let nodes = self.document.nodes.iter();
                let nodes = nodes.map(|node| (node.id, &node.kind, &node.path, port.min));
                // An edge has as many of them as a node at most, and needs none.
                let edges = self.document.edges.iter();
                let edges = edges.filter_map(|e| Some((e.id?, &e.kind, &e.path, 0)));
                for (id, kind, path, least) in nodes.chain(edges) {
                    let is_of = self.schema.is_a(kind, &port.entity);
                    let count = counts.get(&(relation.name.as_str(), at, id));
                    let count = count.copied().unwrap_or_default();
                    let fits = count >= least && port.max.is_none_or(|most| count <= most);
                    if is_of && !fits {
                        let most = port.max.map(|most| most.to_string()).unwrap_or_default();
                        let message = format!(
                            "{} {} is {count} times `{}` of `{}`; expected {least}:{most}",
                            if self.nodes.contains_key(&id) {
                                "node"
                            } else {
                                "edge"
                            },
                            shown(id),
                            port.name,
                            relation.name,
                        );
                        wrong.push((path.clone(), message));
                    }
                }
            }
        }
        for (path, message) in wrong {
            self.error("wrong-count", &path, message);
        }
    }

    fn keys(&mut self) {
        let mut wrong = Vec::new();
        for entity in &self.schema.entities {
            for key in entity.attributes.iter().filter(|a| a.key) {
                // A type that inherits the key is compared with the one that declares it.
                let parent = entity.parent.as_deref().and_then(|p| self.schema.entity(p));
                if parent.is_some_and(|p| p.attribute(&key.name).is_some()) {
                    continue;
                }
                let mut seen: HashMap<String, Id> = HashMap::new();
                for node in &self.document.nodes {
                    if !self.schema.is_a(&node.kind, &entity.name) {
                        continue;
                    }
                    let mut all = node.attributes.iter();
                    let Some((_, value, _)) = all.find(|(name, ..)| *name == key.name) else {
                        continue;
                    };
                    let text = format!("{value:?}");
                    if let Some(first) = seen.insert(text, node.id) {
                        let message = format!(
                            "nodes {} and {} have the same `{}`, which is a key",
                            shown(first),
                            shown(node.id),
                            key.name
                        );
                        wrong.push((path_of(&node.path, "attribute", &key.name), message));
                    }
                }
            }
        }
        for (path, message) in wrong {
            self.error("duplicate-key", &path, message);
        }
    }

    /// Each child has one parent, and no node is above itself.
    fn tree(&mut self, relation: &Relation) {
        let Some(tree) = &relation.tree else { return };
        let mut parents: HashMap<Id, (Id, &str)> = HashMap::new();
        let mut wrong = Vec::new();
        let edges = self.document.edges.iter();
        for edge in edges.filter(|e| e.kind == relation.name && e.from != e.to) {
            let (child, parent) = match tree.child {
                0 => (edge.from, edge.to),
                _ => (edge.to, edge.from),
            };
            if let Some((first, _)) = parents.get(&child) {
                let message = format!(
                    "node {} has two parents in `{}`: {} and {}",
                    shown(child),
                    relation.name,
                    shown(*first),
                    shown(parent)
                );
                wrong.push(("two-parents", edge.path.clone(), message));
            } else {
                parents.insert(child, (parent, &edge.path));
            }
        }
        // Nodes that are known to lead to a top.
        let mut good: HashSet<Id> = HashSet::new();
        let mut starts: Vec<Id> = parents.keys().copied().collect();
        starts.sort_unstable();
        for start in starts {
            let mut way = Vec::new();
            let mut on_way = HashSet::new();
            let mut here = start;
            while !good.contains(&here) {
                if !on_way.insert(here) {
                    let path = parents.get(&here).map(|(_, path)| (*path).to_owned());
                    let message = format!(
                        "node {} is above itself in `{}`",
                        shown(here),
                        relation.name
                    );
                    wrong.push(("cycle-in-tree", path.unwrap_or_default(), message));
                    break;
                }
                way.push(here);
                match parents.get(&here) {
                    Some((parent, _)) => here = *parent,
                    None => break,
                }
            }
            good.extend(way);
        }
        for (code, path, message) in wrong {
            self.error(code, &path, message);
        }
    }

    /// Loops of poses that do not close.
    fn loops(&mut self) {
        let is_loose = |relation: &Relation| relation.tree.is_none() && relation.pose.is_some();
        if !self.schema.relations.iter().any(is_loose) {
            return;
        }
        let Ok(graph) = self.document.graph(Arc::new(self.schema.clone()), 1) else {
            return;
        };
        let graph = graph.snapshot();
        let edges = self.document.edges.iter();
        let paths: HashMap<Id, &str> = edges
            .filter_map(|edge| Some((edge.id?, edge.path.as_str())))
            .collect();
        for found in graph.loops() {
            let apart = found.disagreement;
            if apart.distance <= CLOSED && apart.angle <= CLOSED {
                continue;
            }
            let Ok(edge) = graph.edge(found.edge) else {
                continue;
            };
            let message = format!(
                "the pose of `{}` differs from that of {} other edges by a distance of {:.6} and an angle of {:.6}",
                foreign::clean(edge.type_name()),
                found.chain.links.len(),
                apart.distance,
                apart.angle
            );
            let help = found.chain.operations(&graph).join("; ");
            let path = paths.get(&edge.id()).copied().unwrap_or_default();
            let code = "open-loop";
            self.push(Severity::Warning, code, path, message, Some(help));
        }
    }
}

/// An id as its file has it.
fn shown(id: Id) -> String {
    match id.writer() {
        0 => id.count().to_string(),
        writer => format!("{writer}:{}", id.count()),
    }
}

/// Whether a path is that of a link of DSR.
fn all_in_links(path: &str) -> bool {
    path.split(SEPARATOR).any(|part| part == "links")
}

/// The path of an attribute: in DSR below `attribute` or `linkAttribute`, in ours below
/// `attributes`.
fn path_of(above: &str, member: &str, name: &str) -> String {
    let is_dsr = above.split(SEPARATOR).any(|part| part == "DSRModel");
    let member = if is_dsr { member } else { "attributes" };
    if is_dsr && name == "name" && member == "attribute" {
        return format!("{above}{SEPARATOR}name");
    }
    format!("{above}{SEPARATOR}{member}{SEPARATOR}{name}")
}
