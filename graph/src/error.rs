//! Errors of questions and changes.

use thiserror::Error;

/// Error of a question or of a change, which was not made. Texts of the caller are cleaned.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum Error {
    /// The element was removed.
    #[error("the element was removed")]
    Removed,
    /// No element has the id.
    #[error("no element has the id {0:#x}")]
    UnknownId(u128),
    /// An element has the id already.
    #[error("an element has the id {0:#x} already")]
    DuplicateId(u128),
    /// The graph has no place for more elements.
    #[error("a graph has at most {0} elements")]
    TooMany(usize),
    /// A change has too many steps.
    #[error("a change has at most {0} steps")]
    TooLarge(usize),
    /// A strict schema has no such type.
    #[error("the schema has no {what} `{name}`{}", did_you_mean(nearest.as_deref()))]
    UnknownType {
        /// `entity` or `relation`.
        what: &'static str,
        /// The name.
        name: String,
        /// The name that is most like it.
        nearest: Option<String>,
    },
    /// A type has no such attribute.
    #[error("`{kind}` has no attribute `{name}`{}", did_you_mean(nearest.as_deref()))]
    UnknownAttribute {
        /// The type.
        kind: String,
        /// The attribute.
        name: String,
        /// The attribute that is most like it.
        nearest: Option<String>,
    },
    /// An attribute has a value of another type, or out of its range.
    #[error("`{attribute}` of `{kind}` is {expected}, found {found}")]
    Value {
        /// The type.
        kind: String,
        /// The attribute.
        attribute: String,
        /// The schema's requirement.
        expected: String,
        /// The actual value.
        found: String,
    },
    /// Another graph has two values where the schema of this one has one.
    #[error(
        "`{}` and `{}` of `{kind}` are one value, which is given twice", .attributes[0], .attributes[1]
    )]
    SaidTwice {
        /// The type.
        kind: String,
        /// The attributes that have the value.
        attributes: [String; 2],
    },
    /// A number is infinite, or not a number.
    #[error("a value for `{0}` is not finite")]
    NotFinite(String),
    /// A value has too many bytes.
    #[error(
        "a value for `{0}` has more than 65536 bytes; publish it on a topic, and set a reference to \
         the sample"
    )]
    TooManyBytes(String),
    /// A node has no value for an attribute that is not optional.
    #[error("a `{kind}` has no `{attribute}`, which is not optional")]
    Missing {
        /// The type.
        kind: String,
        /// The attribute.
        attribute: String,
    },
    /// A port does not accept the type.
    #[error("port `{port}` of `{relation}` is for {expected}, found {found}")]
    Port {
        /// The relation.
        relation: String,
        /// The port.
        port: String,
        /// Its type.
        expected: String,
        /// The type of the node.
        found: String,
    },
    /// A node has too few or too many edges.
    #[error("a node of `{kind}` is {found} times `{port}` of `{relation}`; expected {expected}")]
    Cardinality {
        /// The type of the node.
        kind: String,
        /// The relation.
        relation: String,
        /// The port.
        port: String,
        /// How many edges are allowed.
        expected: String,
        /// How many there are.
        found: usize,
    },
    /// A node of a tree has two parents.
    #[error("{0} has two parents in `{1}`, whose edges form a tree")]
    TwoParents(String, String),
    /// A tree goes round.
    #[error("{0} is above itself in `{1}`, whose edges form a tree")]
    Cycle(String, String),
    /// Two nodes have one key.
    #[error("two nodes of `{kind}` have the {attribute} `{value}`, which is a key")]
    DuplicateKey {
        /// The type.
        kind: String,
        /// The attribute.
        attribute: String,
        /// The value.
        value: String,
    },
    /// A rule of the schema does not hold.
    #[error("{message}: {left} {comparison} {right} does not hold for an edge of `{relation}`")]
    Rule {
        /// The relation.
        relation: String,
        /// The schema's requirement.
        message: String,
        /// The left number.
        left: f64,
        /// The comparison.
        comparison: &'static str,
        /// The right number.
        right: f64,
    },
    /// A pose has too few numbers.
    #[error("an edge of `{0}` has no pose: expected {1}")]
    NoPose(String, String),
    /// The node is in no tree with transforms.
    #[error("the node is in no tree with transforms")]
    NoFrame,
    /// Two nodes are in different trees.
    #[error("the nodes are in different trees")]
    NotConnected,
    /// The history does not reach so far back.
    #[error("the history starts later")]
    TooEarly,
    /// The tree of frames refused a change.
    #[error(transparent)]
    Tree(#[from] innermodel::Error),
}

fn did_you_mean(nearest: Option<&str>) -> String {
    nearest.map_or_else(String::new, |near| format!(", did you mean `{near}`?"))
}
