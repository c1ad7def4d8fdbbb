//! The part of a graph that belongs to one domain, and parts that are joined again.

use crate::document::{Attribute, Document, Edge, Node};
use graph_schema::{Difference, Schema};
use property_graph::Id;
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
    /// The schemas that the graphs name are different ones.
    #[error("the graphs have different schemas:{}", listed(.0))]
    Schemas(Vec<Difference>),
}

/// How many differences a message lists.
const MOST_LISTED: usize = 20;

fn listed(all: &[Difference]) -> String {
    let shown = all.iter().take(MOST_LISTED);
    let mut text: String = shown
        .map(|difference| format!("\n  {difference}"))
        .collect();
    if all.len() > MOST_LISTED {
        text += &format!("\n  and {} more", all.len() - MOST_LISTED);
    }
    text
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
    /// these edges. Types that no domain declares belong to that of the schema itself, so that the
    /// parts of all domains [joined](Self::join) are the graph.
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
        let by_id = self.edges.iter().filter_map(|edge| Some((edge.id?, edge)));
        let by_id: HashMap<Id, &Edge> = by_id.collect();
        let own_edges = self.edges.iter().filter(|edge| of(&relations, &edge.kind));
        // An edge may end at an edge, which comes with its own ends.
        let mut ends: HashSet<Id> = HashSet::new();
        let mut left: Vec<&Edge> = own_edges.collect();
        while let Some(edge) = left.pop() {
            for end in [edge.from, edge.to] {
                if ends.insert(end) {
                    left.extend(by_id.get(&end));
                }
            }
        }
        let is_in = |edge: &&Edge| {
            of(&relations, &edge.kind) || edge.id.is_some_and(|id| ends.contains(&id))
        };
        let edges: Vec<Edge> = self.edges.iter().filter(is_in).cloned().collect();
        let is_in = |node: &&Node| of(&entities, &node.kind) || ends.contains(&node.id);
        Self {
            schema: self.schema.clone(),
            nodes: self.nodes.iter().filter(is_in).cloned().collect(),
            edges,
            ..Self::default()
        }
    }

    /// Adds another graph. Common elements stay once. Elements are in the order of ids then.
    /// `schemas` are that of this graph and that of the other one: two files of one name, in two
    /// folders, may declare different types, and two names may denote one content.
    ///
    /// # Errors
    /// The graphs have an element of the same id that is not equal, or both name a schema and these
    /// differ. Nothing has changed then.
    pub fn join(&mut self, other: &Self, schemas: (&Schema, &Schema)) -> Result<(), JoinError> {
        if self.schema.is_some() && other.schema.is_some() {
            let differences = schemas.0.differences(schemas.1);
            if !differences.is_empty() {
                return Err(JoinError::Schemas(differences));
            }
        }
        let schema = self.schema.clone().or_else(|| other.schema.clone());
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
            ..Self::default()
        };
        Ok(())
    }
}

/// Whether attributes are equal, in any order.
fn equal(a: &[Attribute], b: &[Attribute]) -> bool {
    let sorted = |all: &[Attribute]| {
        let mut all: Vec<Attribute> = all.to_vec();
        all.sort_by(|a, b| a.0.cmp(&b.0));
        all
    };
    a == b || sorted(a) == sorted(b)
}
