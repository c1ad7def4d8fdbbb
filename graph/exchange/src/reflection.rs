//! Types and domains as nodes, so that queries can ask for the types of elements.

use crate::document::{Document, Edge, Node};
use graph_schema::{Attribute, Entity, Kind, Port, Relation, Schema};
use property_graph::Id;
use std::collections::BTreeMap;

/// The writer of the ids of types and domains, which no graph has.
const WRITER: u64 = u64::MAX;
/// The types that the reflection adds.
const TYPE: &str = "Type";
const DOMAIN: &str = "Domain";
const INSTANCE_OF: &str = "instance_of";
const IS_A: &str = "is_a";

impl Document {
    /// The graph with the types and domains of its schema as nodes `Type` and `Domain`, and the
    /// schema of all this. `instance_of` leads from each node and each edge to its type, and from
    /// there to the domain; `is_a` leads from a type to its parent. `None` if the schema has one of
    /// these four names with another meaning.
    pub fn reflected(&self, schema: &Schema) -> Option<(Self, Schema)> {
        let is_free =
            |name: &&str| schema.entity(name).is_none() && schema.relation(name).is_none();
        if ![TYPE, DOMAIN, INSTANCE_OF, IS_A].iter().all(is_free) {
            return None;
        }
        let mut made = Reflection {
            document: self.clone(),
            schema,
            next: 0,
            places: BTreeMap::new(),
        };
        for entity in &schema.entities {
            made.kind(&entity.name);
        }
        for relation in &schema.relations {
            made.kind(&relation.name);
        }
        for node in &self.nodes {
            let kind = made.kind(&node.kind);
            made.edge(INSTANCE_OF, node.id, kind);
        }
        for (edge, id) in self.edges.iter().filter_map(|edge| Some((edge, edge.id?))) {
            let kind = made.kind(&edge.kind);
            made.edge(INSTANCE_OF, id, kind);
        }
        let document = made.document;
        Some((document, with_reflection(schema)))
    }
}

struct Reflection<'s> {
    document: Document,
    schema: &'s Schema,
    next: u64,
    places: BTreeMap<(&'static str, String), Id>,
}

impl Reflection<'_> {
    fn id(&mut self) -> Id {
        self.next += 1;
        Id::new(WRITER, self.next)
    }

    /// The node of a type or a domain, and whether it is new.
    fn node(&mut self, kind: &'static str, name: &str) -> (Id, bool) {
        let key = (kind, name.to_owned());
        if let Some(known) = self.places.get(&key) {
            return (*known, false);
        }
        let id = self.id();
        self.places.insert(key, id);
        self.document.nodes.push(Node {
            id,
            kind: kind.to_owned(),
            attributes: vec![("name".to_owned(), name.into(), None)],
            path: String::new(),
        });
        (id, true)
    }

    /// The node of a type, with those of its domain and its ancestors.
    fn kind(&mut self, name: &str) -> Id {
        let schema = self.schema;
        let mut below: Option<Id> = None;
        let mut first = None;
        for name in schema.ancestry(name) {
            let (kind, is_new) = self.node(TYPE, name);
            first = first.or(Some(kind));
            if let Some(below) = below {
                self.edge(IS_A, below, kind);
            }
            if !is_new {
                break;
            }
            let (domain, _) = self.node(DOMAIN, schema.domain(name));
            self.edge(INSTANCE_OF, kind, domain);
            below = Some(kind);
        }
        first.unwrap_or_default()
    }

    fn edge(&mut self, kind: &str, from: Id, to: Id) {
        let id = self.id();
        self.document.edges.push(Edge {
            id: Some(id),
            kind: kind.to_owned(),
            from,
            to,
            attributes: Vec::new(),
            path: String::new(),
        });
    }
}

/// A schema with the types of reflection.
fn with_reflection(schema: &Schema) -> Schema {
    let entity = |name: &str| Entity {
        name: name.to_owned(),
        attributes: vec![Attribute {
            name: "name".to_owned(),
            kind: Kind::Text,
            unit: None,
            range: None,
            optional: false,
            key: false,
            history: None,
            doc: Vec::new(),
        }],
        ..Entity::default()
    };
    // Everything is an instance of something, so these ports have no type.
    let relation = |name: &str| Relation {
        name: name.to_owned(),
        ports: vec![Port::default(), Port::default()],
        ..Relation::default()
    };
    let mut all = schema.clone();
    all.entities.extend([entity(TYPE), entity(DOMAIN)]);
    all.relations
        .extend([relation(INSTANCE_OF), relation(IS_A)]);
    all
}
