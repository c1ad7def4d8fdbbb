//! The schema of a property graph: entities, relations with named ports, attributes with types,
//! units and ranges. `graph-language` makes a [`Schema`] of `.gdsl` files, the store checks changes
//! against it, queries are checked against it before they run.
//!
#![doc = include_str!("example.md")]

mod block;
mod difference;
mod unit;

pub use block::{Block, Conversion, Number};
pub use difference::Difference;
pub use rc_formula::Program;
pub use rc_quantity::Factor;
pub use rc_vocabulary::Primitive;
pub use unit::{compared_units, conversion, is_same_unit};

use std::sync::Arc;
use std::time::Duration;

/// How many ancestors an entity may have. Each question about inheritance walks over them.
pub const DEEPEST: usize = 64;

/// The relation from a composite to its parts.
pub const COMPOSED_BY: &str = "composed_by";

/// The types of a graph.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Schema {
    /// Name of the domain that was loaded. Types of imported domains are among the types, too.
    pub name: String,
    /// Whether the graph may have types and attributes that are not declared.
    pub open: bool,
    /// Types of nodes.
    pub entities: Vec<Entity>,
    /// Types of edges.
    pub relations: Vec<Relation>,
    /// Rules over relations.
    pub rules: Vec<Rule>,
    /// Queries with a name.
    pub queries: Vec<Query>,
}

/// A type of nodes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Entity {
    /// Name of the type.
    pub name: String,
    /// The domain that declares it.
    pub domain: String,
    /// The type whose attributes this one has, too, and whose ports accept it.
    pub parent: Option<String>,
    /// Attributes, inherited ones first.
    pub attributes: Vec<Attribute>,
    /// The types of nodes that compose a node of this type, each over the same edges.
    pub parts: Vec<String>,
    /// Lines of documentation.
    pub doc: Vec<String>,
}

/// A type of edges.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Relation {
    /// Name of the type.
    pub name: String,
    /// The domain that declares it.
    pub domain: String,
    /// The first port is where an edge starts, the second one is where it ends.
    pub ports: Vec<Port>,
    /// Attributes of an edge.
    pub attributes: Vec<Attribute>,
    /// The structure of the edges.
    pub tree: Option<Tree>,
    /// Where its ends are, if the edges form no tree: they may close loops.
    pub pose: Option<Placed>,
    /// The entity of an edge as a node to other edges that start or end at it: it fits where this
    /// entity does.
    pub promotes: Option<String>,
    /// Lines of documentation.
    pub doc: Vec<String>,
}

/// One end of a relation.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Port {
    /// Name of the port.
    pub name: String,
    /// Type of its nodes.
    pub entity: String,
    /// How many edges of the relation each node has at this port, at least.
    pub min: u32,
    /// The most edges. `None` is any number.
    pub max: Option<u32>,
}

/// A relation whose edges form a forest.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tree {
    /// The port of the children: 0 or 1. A node is there in one edge at most.
    pub child: usize,
    /// The attributes with the pose of the child in its parent, if the relation has transforms.
    pub pose: Option<PoseOf>,
}

/// A relation that says where one end is in the other one.
#[derive(Clone, Debug, PartialEq)]
pub struct Placed {
    /// The port of the end whose pose it is: 0 or 1.
    pub child: usize,
    /// The attributes with the pose of the child in the other end.
    pub pose: PoseOf,
}

/// The attributes that hold a pose.
#[derive(Clone, Debug, PartialEq)]
pub enum PoseOf {
    /// One attribute: x, y, z and the angles about x, y and z.
    One(String),
    /// One for the translation and one for the angles.
    Two(String, String),
}

/// An attribute of a type.
#[derive(Clone, Debug, PartialEq)]
pub struct Attribute {
    /// Name of the attribute.
    pub name: String,
    /// Type of its value.
    pub kind: Kind,
    /// Unit of its numbers.
    pub unit: Option<String>,
    /// The least and the greatest number.
    pub range: Option<(f64, f64)>,
    /// Whether an element may be without it.
    pub optional: bool,
    /// Whether no two elements of the type have the same value.
    pub key: bool,
    /// How long earlier values are kept.
    pub history: Option<Duration>,
    /// Lines of documentation.
    pub doc: Vec<String>,
}

/// The type of a value.
#[derive(Clone, Debug, PartialEq)]
pub enum Kind {
    /// `bool`
    Bool,
    /// `int`: 64 bits.
    Int,
    /// `float`: 64 bits. An integer is accepted, too.
    Float,
    /// `string`
    Text,
    /// `bytes`: 64 KiB at most.
    Bytes,
    /// `{a, b}`: one of these texts.
    Enum(Vec<String>),
    /// `int[]`, or `int[N]`
    Ints(Option<usize>),
    /// `float[]`, or `float[N]`
    Floats(Option<usize>),
    /// `string[]`
    Texts,
    /// `dproto NAME`: the numbers of a data prototype.
    Block(Arc<Block>),
    /// `topic`, or `topic "TYPE"`: a reference to a sample of a topic, of this type.
    Topic(Option<String>),
}

impl Kind {
    /// The type as a schema names it.
    pub fn text(&self) -> String {
        let sized = |what: &str, count: &Option<usize>| match count {
            Some(count) => format!("{what}[{count}]"),
            None => format!("{what}[]"),
        };
        match self {
            Self::Bool => "bool".to_owned(),
            Self::Int => "int".to_owned(),
            Self::Float => "float".to_owned(),
            Self::Text => "string".to_owned(),
            Self::Bytes => "bytes".to_owned(),
            Self::Enum(words) => format!("{{{}}}", words.join(", ")),
            Self::Ints(count) => sized("int", count),
            Self::Floats(count) => sized("float", count),
            Self::Texts => "string[]".to_owned(),
            Self::Block(block) => block.text(),
            Self::Topic(None) => "topic".to_owned(),
            Self::Topic(Some(kind)) => format!("topic \"{kind}\""),
        }
    }
}

impl Attribute {
    /// The attribute whose value this one is, perhaps in another representation: itself, or the one
    /// that `consistency` names. An element has one value for all attributes with the same one.
    pub fn value_of(&self) -> &str {
        let of = match &self.kind {
            Kind::Block(block) => block.consistent_with.as_deref(),
            _ => None,
        };
        of.unwrap_or(&self.name)
    }

    /// The unit of all its numbers, if they have one.
    pub fn common_unit(&self) -> Option<&str> {
        match &self.kind {
            Kind::Block(block) => block.common_unit(),
            _ => self.unit.as_deref(),
        }
    }
}

/// `require Object.mass <= Gripper.payload of Grasp "heavier than the payload";`
#[derive(Clone, Debug, PartialEq)]
pub struct Rule {
    /// The relation whose edges must fulfil it.
    pub relation: String,
    /// Port and attribute on the left.
    pub left: (usize, String),
    /// The comparison.
    pub comparison: Comparison,
    /// Port and attribute on the right.
    pub right: (usize, String),
    /// The message for a violation.
    pub message: String,
}

/// The comparison of two numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Comparison {
    /// `<`
    Less,
    /// `<=`
    LessOrEqual,
    /// `>`
    Greater,
    /// `>=`
    GreaterOrEqual,
    /// `==`
    Equal,
    /// `!=`
    NotEqual,
}

impl Comparison {
    /// Whether `a` and `b` compare so.
    pub fn holds(self, a: f64, b: f64) -> bool {
        match self {
            Self::Less => a < b,
            Self::LessOrEqual => a <= b,
            Self::Greater => a > b,
            Self::GreaterOrEqual => a >= b,
            Self::Equal => a == b,
            Self::NotEqual => a != b,
        }
    }

    /// The comparison as a schema writes it.
    pub fn text(self) -> &'static str {
        match self {
            Self::Less => "<",
            Self::LessOrEqual => "<=",
            Self::Greater => ">",
            Self::GreaterOrEqual => ">=",
            Self::Equal => "==",
            Self::NotEqual => "!=",
        }
    }
}

/// A query with a name.
#[derive(Clone, Debug, PartialEq)]
pub struct Query {
    /// Name of the query.
    pub name: String,
    /// Names and types of its parameters. A type is that of an attribute, or an entity.
    pub parameters: Vec<(String, String)>,
    /// The text, in openCypher.
    pub text: String,
}

impl Schema {
    /// A schema that allows everything.
    pub fn anything() -> Self {
        Self {
            open: true,
            ..Self::default()
        }
    }

    /// A type of nodes.
    pub fn entity(&self, name: &str) -> Option<&Entity> {
        self.entities.iter().find(|entity| entity.name == name)
    }

    /// A type of edges.
    pub fn relation(&self, name: &str) -> Option<&Relation> {
        self.relations.iter().find(|relation| relation.name == name)
    }

    /// The unit of the lengths of all transforms, which a schema has once. `None` if it says none.
    pub fn unit_of_lengths(&self) -> Option<&str> {
        self.relations.iter().find_map(|relation| {
            let (PoseOf::One(name) | PoseOf::Two(name, _)) = relation.placed()?.pose;
            let attribute = relation.attribute(&name)?;
            match attribute.kind {
                // Transforms have metres of any prototype.
                Kind::Block(_) => Some("m"),
                _ => attribute.unit.as_deref(),
            }
        })
    }

    /// Whether nodes have transforms: edges of a tree have poses.
    pub fn has_transforms(&self) -> bool {
        let mut trees = self.relations.iter().filter_map(|own| own.tree.as_ref());
        trees.any(|tree| tree.pose.is_some())
    }

    /// A type, and all that it inherits from, the nearest first; for a relation, what its edges are
    /// to others. A type that is not declared is alone.
    pub fn ancestry<'a>(&'a self, name: &'a str) -> impl Iterator<Item = &'a str> {
        let parent = |name: &&str| match self.entity(name) {
            Some(entity) => entity.parent.as_deref(),
            None => self.relation(name)?.promotes.as_deref(),
        };
        // An inheritance that goes round, which the language refuses, ends here, too.
        std::iter::successors(Some(name), parent).take(DEEPEST + 2)
    }

    /// The domain that declares a type. A type that none declares belongs to that of the schema
    /// itself.
    pub fn domain(&self, name: &str) -> &str {
        let entity = self.entity(name).map(|entity| entity.domain.as_str());
        let domain = entity.or_else(|| Some(self.relation(name)?.domain.as_str()));
        domain.unwrap_or(&self.name)
    }

    /// The attributes of a type of nodes or edges.
    pub fn attributes(&self, kind: &str) -> Option<&[Attribute]> {
        let entity = self.entity(kind).map(|entity| &*entity.attributes);
        entity.or_else(|| Some(&self.relation(kind)?.attributes))
    }

    /// The names of all types.
    pub fn types(&self) -> impl Iterator<Item = &str> {
        let entities = self.entities.iter().map(|entity| &*entity.name);
        entities.chain(self.relations.iter().map(|relation| &*relation.name))
    }

    /// Whether a type is `wanted`, or inherits from it.
    pub fn is_a(&self, name: &str, wanted: &str) -> bool {
        self.ancestry(name).any(|name| name == wanted)
    }
}

impl Entity {
    /// An attribute.
    pub fn attribute(&self, name: &str) -> Option<&Attribute> {
        self.attributes.iter().find(|a| a.name == name)
    }
}

impl Relation {
    /// Where its ends are, whether its edges form a tree or not.
    pub fn placed(&self) -> Option<Placed> {
        let Some(tree) = &self.tree else {
            return self.pose.clone();
        };
        Some(Placed {
            child: tree.child,
            pose: tree.pose.clone()?,
        })
    }

    /// An attribute.
    pub fn attribute(&self, name: &str) -> Option<&Attribute> {
        self.attributes.iter().find(|a| a.name == name)
    }
}
