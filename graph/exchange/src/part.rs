//! The part of a graph that belongs to one domain, and parts that are joined again.

use crate::document::{Document, Edge, Node};
use graph_schema::Schema;
use property_graph::{Id, Value};
use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};
use thiserror::Error;

/// Why graphs cannot be joined.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum JoinError {
    /// An id is that of two different elements.
    #[error("{}:{} is not the same element in both graphs", .0.writer(), .0.count())]
    Differs(Id),
    /// An edge has no id, as in files of DSR: it cannot be found again.
    #[error("an edge has no id; import the file of DSR first")]
    NoId,
    /// The graphs name two schemas.
    #[error("one graph names the schema `{0}`, the other one `{1}`")]
    Schemas(String, String),
}

/// The domains whose types a schema has, and its own.
pub fn domains(schema: &Schema) -> BTreeSet<&str> {
    let entities = schema.entities.iter().map(|entity| entity.domain.as_str());
    let relations = schema.relations.iter().map(|r| r.domain.as_str());
    let all = entities.chain(relations).chain([schema.name.as_str()]);
    all.filter(|name| !name.is_empty()).collect()
}

impl Document {
    /// The part of a domain: nodes and edges whose type it declares, and the nodes at the ends of
    /// these edges. What no domain declares belongs to that of the schema itself, so that the parts
    /// of all domains [joined](Self::join) are the graph.
    #[must_use]
    pub fn part(&self, schema: &Schema, domain: &str) -> Self {
        let own = schema.name.as_str();
        let entities = schema.entities.iter().map(|e| (&*e.name, &*e.domain));
        let relations = schema.relations.iter().map(|r| (&*r.name, &*r.domain));
        let (entities, relations): (HashMap<_, _>, HashMap<_, _>) =
            (entities.collect(), relations.collect());
        let of = |domains: &HashMap<&str, &str>, kind: &str| {
            domains.get(kind).copied().unwrap_or(own) == domain
        };
        let edges = self.edges.iter().filter(|edge| of(&relations, &edge.kind));
        let edges: Vec<Edge> = edges.cloned().collect();
        let ends: HashSet<Id> = edges.iter().flat_map(|edge| [edge.from, edge.to]).collect();
        let is_in = |node: &&Node| of(&entities, &node.kind) || ends.contains(&node.id);
        Self {
            schema: self.schema.clone(),
            nodes: self.nodes.iter().filter(is_in).cloned().collect(),
            edges,
        }
    }

    /// Adds another graph. What both have stays once. Elements are in the order of ids then.
    ///
    /// # Errors
    /// The graphs have an element of the same id that is not equal, or two schemas. Nothing has
    /// changed then.
    pub fn join(&mut self, other: &Self) -> Result<(), JoinError> {
        let schema = match (&self.schema, &other.schema) {
            (Some(own), Some(other)) if own != other => {
                return Err(JoinError::Schemas(own.clone(), other.clone()));
            }
            (own, other) => own.clone().or_else(|| other.clone()),
        };
        let mut nodes: BTreeMap<Id, &Node> = BTreeMap::new();
        for node in self.nodes.iter().chain(&other.nodes) {
            let first = *nodes.entry(node.id).or_insert(node);
            let is_equal = first.kind == node.kind && equal(&first.attributes, &node.attributes);
            if !is_equal {
                return Err(JoinError::Differs(node.id));
            }
        }
        let mut edges: BTreeMap<Id, &Edge> = BTreeMap::new();
        for edge in self.edges.iter().chain(&other.edges) {
            let id = edge.id.ok_or(JoinError::NoId)?;
            let first = *edges.entry(id).or_insert(edge);
            let is_equal = first.kind == edge.kind
                && (first.from, first.to) == (edge.from, edge.to)
                && equal(&first.attributes, &edge.attributes);
            if !is_equal || nodes.contains_key(&id) {
                return Err(JoinError::Differs(id));
            }
        }
        *self = Self {
            schema,
            nodes: nodes.into_values().cloned().collect(),
            edges: edges.into_values().cloned().collect(),
        };
        Ok(())
    }
}

type Attribute = (String, Value, Option<String>);

/// Whether attributes are equal, in any order.
fn equal(a: &[Attribute], b: &[Attribute]) -> bool {
    let sorted = |all: &[Attribute]| {
        let mut all: Vec<Attribute> = all.to_vec();
        all.sort_by(|a, b| a.0.cmp(&b.0));
        all
    };
    a == b || sorted(a) == sorted(b)
}
