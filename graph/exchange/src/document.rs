//! A graph as a file has it.

use graph_schema::{Entity, Kind, Placed, Port, PoseOf, Relation, Schema};
use property_graph::{Edit, Error, Graph, Id, NodeId, Snapshot, Time, Value, in_order};
use std::collections::HashMap;
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
    /// The schema does not allow the graph, or an edge has an end that is no node.
    pub fn graph(&self, schema: Arc<Schema>, writer: u64) -> Result<Graph, Error> {
        let graph = Graph::new(schema, writer);
        graph.change(Time::ZERO, |edit| self.add(edit))?;
        Ok(graph)
    }

    /// Makes a graph that keeps everything, whatever its schema says: with the trees of the schema, or
    /// without trees if the document breaks one or has no pose for an edge. Then the poses of edges
    /// may close loops. Attributes that are one value convert, and those with data prototypes are poses,
    /// unless one has numbers that are none.
    ///
    /// # Errors
    /// An edge has an end that is no node, or an id is there twice.
    pub fn kept(&self, schema: &Schema, writer: u64) -> Result<Graph, Error> {
        let ways = [(true, true), (false, true), (true, false)];
        for (trees, blocks) in ways {
            if let Ok(graph) = self.graph(loose(schema, trees, blocks).into(), writer) {
                return Ok(graph);
            }
        }
        self.graph(loose(schema, false, false).into(), writer)
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
            schema: None,
            nodes,
            edges,
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
    loose(schema, true, true)
}

/// A schema that keeps everything, with the poses of another one. It has its `trees`, unless a file
/// closes loops in these, and its `blocks` that convert or are poses, unless a file has other numbers.
fn loose(schema: &Schema, trees: bool, blocks: bool) -> Schema {
    let shared = |all: &[graph_schema::Attribute]| -> Vec<graph_schema::Attribute> {
        let is_of_use = |attribute: &&graph_schema::Attribute| match &attribute.kind {
            Kind::Block(block) => blocks && (!block.conversions.is_empty() || block.pose.is_some()),
            _ => false,
        };
        let all = all.iter().filter(is_of_use).cloned();
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
            attributes: shared(&relation.attributes),
            ..Relation::default()
        };
        if blocks || !has_block_as_pose(relation) {
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
        attributes: shared(&entity.attributes),
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
