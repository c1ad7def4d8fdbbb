//! A graph as a file has it.

use graph_schema::{Entity, Kind, Placed, Port, PoseOf, Relation, Schema};
use property_graph::{Edit, Error, Graph, Id, NodeId, Snapshot, Time, Value, fits, in_order};
use std::collections::{BTreeSet, HashMap};
use std::sync::Arc;

/// A graph as a file has it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Document {
    /// The file of the schema, if the document names one.
    pub schema: Option<String>,
    /// Nodes, in the order of the file.
    pub nodes: Vec<Node>,
    /// Edges, in the order of the file.
    pub edges: Vec<Edge>,
    /// Where attributes are whose values have been told to be wrong already.
    pub(crate) unread: Vec<String>,
}

/// Name, value, and the unit as written.
pub type Attribute = (String, Value, Option<String>);

/// A node of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Node {
    /// The id.
    pub id: Id,
    /// Type of the node.
    pub kind: String,
    /// Names, values and units as written.
    pub attributes: Vec<Attribute>,
    /// Where it is in the file.
    pub(crate) path: String,
}

/// An edge of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Edge {
    /// The id. Files of DSR have none: the graph makes one.
    pub id: Option<Id>,
    /// The relation.
    pub kind: String,
    /// The id of the node where it starts, or of an edge.
    pub from: Id,
    /// The id of the node where it ends, or of an edge.
    pub to: Id,
    /// Names, values and units as written.
    pub attributes: Vec<Attribute>,
    /// Where it is in the file.
    pub(crate) path: String,
}

impl Document {
    /// Makes a graph of the document, for this schema.
    ///
    /// # Errors
    /// The schema does not allow the graph, or an edge has an end that is not a node.
    pub fn graph(&self, schema: Arc<Schema>, writer: u64) -> Result<Graph, Error> {
        let graph = Graph::new(schema, writer);
        graph.change(Time::ZERO, |edit| self.add(edit))?;
        Ok(graph)
    }

    /// Makes a graph that keeps everything, whatever its schema says: with the trees of the schema,
    /// or without trees if the document breaks one or has no pose for an edge. Then the poses of
    /// edges may close loops. Attributes that are one value convert, and those with data prototypes
    /// are poses, except for the types that [`Document::unconverted`] names.
    ///
    /// # Errors
    /// An edge has an end that is not a node, or an id is there twice.
    pub fn kept(&self, schema: &Schema, writer: u64) -> Result<Graph, Error> {
        let unconverted = self.unconverted(schema);
        let with_trees = self.graph(loose(schema, true, &unconverted).into(), writer);
        with_trees.or_else(|_| self.graph(loose(schema, false, &unconverted).into(), writer))
    }

    /// The types whose attributes do not convert in the graph that [`Document::kept`] makes, and
    /// are not poses there: a node or an edge has numbers that its data prototype refuses, or says
    /// one value twice.
    pub fn unconverted<'s>(&self, schema: &'s Schema) -> BTreeSet<&'s str> {
        let entities = schema.entities.iter().map(|e| (&*e.name, &e.attributes));
        let relations = schema.relations.iter().map(|r| (&*r.name, &r.attributes));
        let types: HashMap<&str, HashMap<&str, &graph_schema::Attribute>> = entities
            .chain(relations)
            .filter(|(_, attributes)| attributes.iter().any(is_of_use))
            .map(|(name, attributes)| {
                let of_use = attributes.iter().filter(|own| is_of_use(own));
                (name, of_use.map(|own| (&*own.name, own)).collect())
            })
            .collect();
        let nodes = self.nodes.iter().map(|node| (&node.kind, &node.attributes));
        let edges = self.edges.iter().map(|edge| (&edge.kind, &edge.attributes));
        let faulty = nodes.chain(edges).filter_map(|(kind, attributes)| {
            let (kind, described) = types.get_key_value(kind.as_str())?;
            let mut said: HashMap<&str, &str> = HashMap::new();
            let mut wrong = attributes.iter().filter(|(name, value, _)| {
                described.get(name.as_str()).is_some_and(|own| {
                    let first = said.entry(own.value_of()).or_insert(name);
                    *first != name.as_str() || fits(own, value).is_err()
                })
            });
            wrong.next().map(|_| *kind)
        });
        faulty.collect()
    }

    /// Adds the document to a graph.
    pub fn add(&self, edit: &mut Edit) -> Result<(), Error> {
        let mut places: HashMap<Id, NodeId> = HashMap::with_capacity(self.nodes.len());
        for node in &self.nodes {
            let made = edit.add_node_as(node.id, node.kind.as_str())?;
            edit.set_all(made, named(&node.attributes))?;
            places.insert(node.id, made);
        }
        let add = |edit: &mut Edit, edge: &Edge, from: NodeId, to: NodeId| {
            let made = match edge.id {
                Some(id) => edit.add_edge_as(id, edge.kind.as_str(), from, to)?,
                None => edit.add_edge(edge.kind.as_str(), from, to)?,
            };
            edit.set_all(made, named(&edge.attributes))
        };
        let mut later = Vec::new();
        for edge in &self.edges {
            match (places.get(&edge.from), places.get(&edge.to)) {
                (Some(from), Some(to)) => add(edit, edge, *from, *to)?,
                _ => later.push(edge),
            }
        }
        let ends = later.iter().map(|edge| (edge.id, [edge.from, edge.to]));
        let ends: Vec<_> = ends.collect();
        let (order, rest) = in_order(&ends, |id| edit.snapshot().find(id).is_some());
        if let Some(wrong) = rest.first().map(|at| later[*at]) {
            let is_there = places.contains_key(&wrong.from);
            let end = if is_there { wrong.to } else { wrong.from };
            return Err(Error::UnknownId(end.0));
        }
        for edge in order.into_iter().map(|at| later[at]) {
            let (from, to) = (edit.end(edge.from)?, edit.end(edge.to)?);
            add(edit, edge, from, to)?;
        }
        Ok(())
    }

    /// The document of a graph, in the order of ids; attributes in the order of their names.
    pub fn of(graph: &Snapshot) -> Self {
        let list = |attributes: &mut dyn Iterator<Item = (&str, &Value)>| {
            let mut all: Vec<_> = attributes
                .map(|(name, value)| (name.to_owned(), value.clone(), None))
                .collect();
            all.sort_by(|a: &Attribute, b| a.0.cmp(&b.0));
            all
        };
        let id_of = |node: NodeId| graph.node(node).map(|node| node.id()).unwrap_or_default();
        let mut nodes: Vec<Node> = graph
            .nodes()
            .map(|node| Node {
                id: node.id(),
                kind: node.type_name().to_owned(),
                attributes: list(&mut node.attributes()),
                path: String::new(),
            })
            .collect();
        nodes.sort_by_key(|node| node.id);
        let mut edges: Vec<Edge> = graph
            .edges()
            .map(|edge| Edge {
                id: Some(edge.id()),
                kind: edge.type_name().to_owned(),
                from: id_of(edge.from()),
                to: id_of(edge.to()),
                attributes: list(&mut edge.attributes()),
                path: String::new(),
            })
            .collect();
        edges.sort_by_key(|edge| edge.id);
        Self {
            nodes,
            edges,
            ..Self::default()
        }
    }
}

fn named(all: &[Attribute]) -> impl Iterator<Item = (&str, Value)> {
    all.iter()
        .map(|(name, value, _)| (name.as_str(), value.clone()))
}

/// A schema that keeps everything, with the trees and poses of another one: for files that are not
/// checked, such as those of DSR whose lengths are millimetres.
pub fn lenient(schema: &Schema) -> Schema {
    loose(schema, true, &BTreeSet::new())
}

/// Whether an attribute converts into others or is a pose.
fn is_of_use(attribute: &graph_schema::Attribute) -> bool {
    match &attribute.kind {
        Kind::Block(block) => !block.conversions.is_empty() || block.pose.is_some(),
        _ => false,
    }
}

/// A schema that keeps everything, with the poses of another one. It has its `trees`, unless a file
/// closes loops in these, and its attributes that convert or are poses, unless their type is one
/// of `unconverted`.
fn loose(schema: &Schema, trees: bool, unconverted: &BTreeSet<&str>) -> Schema {
    let shared = |kind: &str, all: &[graph_schema::Attribute]| -> Vec<graph_schema::Attribute> {
        let converts = !unconverted.contains(kind);
        let all = all.iter().filter(|own| converts && is_of_use(own)).cloned();
        let optional = all.map(|attribute| graph_schema::Attribute {
            optional: true,
            ..attribute
        });
        optional.collect()
    };
    let relations = schema.relations.iter().map(|relation| {
        let mut kept = Relation {
            name: relation.name.clone(),
            domain: relation.domain.clone(),
            ports: vec![Port::default(), Port::default()],
            promotes: relation.promotes.clone(),
            attributes: shared(&relation.name, &relation.attributes),
            ..Relation::default()
        };
        if !unconverted.contains(&*relation.name) || !has_block_as_pose(relation) {
            if trees {
                kept.tree.clone_from(&relation.tree);
                kept.pose.clone_from(&relation.pose);
            } else {
                kept.pose = relation.placed();
            }
        }
        kept
    });
    let of_interest = |relation: &Relation| {
        relation.tree.is_some()
            || relation.pose.is_some()
            || relation.promotes.is_some()
            || !relation.attributes.is_empty()
    };
    // Queries ask which types inherit from others.
    let entities = schema.entities.iter().map(|entity| Entity {
        name: entity.name.clone(),
        domain: entity.domain.clone(),
        parent: entity.parent.clone(),
        attributes: shared(&entity.name, &entity.attributes),
        ..Entity::default()
    });
    Schema {
        name: schema.name.clone(),
        open: true,
        entities: entities.collect(),
        relations: relations.filter(of_interest).collect(),
        ..Schema::default()
    }
}

/// Whether the pose of an edge is that of a data prototype: its numbers are none by themselves.
fn has_block_as_pose(relation: &Relation) -> bool {
    let Some(Placed { pose, .. }) = relation.placed() else {
        return false;
    };
    let PoseOf::One(name) = pose else {
        return false;
    };
    let attribute = relation.attribute(&name);
    attribute.is_some_and(|attribute| matches!(attribute.kind, Kind::Block(_)))
}
