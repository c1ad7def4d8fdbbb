//! The syntax tree of a `.gdsl` file. Names are not resolved.

use rc_diagnostics::Span;
use rc_syntax::{Literal, Name};

/// A file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct File {
    /// The paths of imported files.
    pub imports: Vec<Name>,
    /// The domain. `None` after a syntax error.
    pub domain: Option<Domain>,
}

/// `Domain NAME { … };`
#[derive(Clone, Debug, PartialEq)]
pub struct Domain {
    /// The name.
    pub name: Name,
    /// Whether undeclared types are allowed.
    pub open: bool,
    /// Declarations, in the order of the file.
    pub items: Vec<Item>,
}

/// A declaration.
#[derive(Clone, Debug, PartialEq)]
pub enum Item {
    /// `entity NAME : PARENT { … };`
    Entity(Entity),
    /// `relation NAME { …; tree; };`
    Relation(Relation),
    /// `require A.x <= B.y of R "…";`
    Require(Require),
    /// `query NAME(…) "…";`
    Query(Query),
}

/// A type of nodes.
#[derive(Clone, Debug, PartialEq)]
pub struct Entity {
    /// The name.
    pub name: Name,
    /// The type that it inherits from.
    pub parent: Option<Name>,
    /// The lines of its documentation.
    pub doc: Vec<String>,
    /// Attributes.
    pub members: Vec<Member>,
    /// The types after `composed_by`.
    pub parts: Vec<Name>,
}

/// A type of edges.
#[derive(Clone, Debug, PartialEq)]
pub struct Relation {
    /// The name.
    pub name: Name,
    /// The lines of its documentation.
    pub doc: Vec<String>,
    /// Ports and attributes.
    pub members: Vec<Member>,
    /// The clauses `tree`. A relation may have one.
    pub trees: Vec<Tree>,
    /// The entities of the clauses `promotes`. A relation may have one.
    pub promotes: Vec<Name>,
}

/// An attribute, or a port.
#[derive(Clone, Debug, PartialEq)]
pub struct Member {
    /// The name.
    pub name: Name,
    /// The lines of its documentation.
    pub doc: Vec<String>,
    /// The type.
    pub kind: Type,
    /// What follows the type.
    pub flags: Vec<Flag>,
}

impl Member {
    /// The attribute whose value this one is.
    pub fn consistent_with(&self) -> Option<&Name> {
        self.flags.iter().find_map(|flag| match &flag.kind {
            FlagKind::Consistency(of) => Some(of),
            _ => None,
        })
    }
}

/// The type of a member.
#[derive(Clone, Debug, PartialEq)]
pub enum Type {
    /// A name, perhaps with `[]` or `[N]`.
    Named(Name, Option<Option<Literal>>),
    /// `{a, b}`
    Choice(Vec<Name>),
    /// `dproto NAME`
    Block(Name),
    /// `topic`, or `topic "TYPE"`: the keyword, and the type.
    Topic(Name, Option<Name>),
}

/// A property of a member.
#[derive(Clone, Debug, PartialEq)]
pub struct Flag {
    /// Location of the flag.
    pub span: Span,
    /// Its content.
    pub kind: FlagKind,
}

/// The kinds of flags.
#[derive(Clone, Debug, PartialEq)]
pub enum FlagKind {
    /// `unit "kg"`
    Unit(Name),
    /// `history 2s`
    History(Literal),
    /// `key`
    Key,
    /// `optional`
    Optional,
    /// `consistency ATTRIBUTE`
    Consistency(Name),
    /// `0:10`
    Range(Option<Literal>, Option<Literal>),
}

/// `tree of PORT interpolated(a, b)`
#[derive(Clone, Debug, PartialEq)]
pub struct Tree {
    /// The keyword.
    pub span: Span,
    /// The port of the children.
    pub of: Option<Name>,
    /// Whether the tree has transforms.
    pub interpolated: bool,
    /// The attributes with the pose.
    pub pose: Vec<Name>,
}

/// `require Object.mass <= Gripper.payload of Grasp "heavier than the payload";`
#[derive(Clone, Debug, PartialEq)]
pub struct Require {
    /// Port or entity, and attribute, on the left.
    pub left: (Name, Name),
    /// The comparison.
    pub comparison: Name,
    /// Port or entity, and attribute, on the right.
    pub right: (Name, Name),
    /// The relation.
    pub relation: Name,
    /// The message for a violation.
    pub message: Name,
}

/// `query people_in(room Room) "MATCH …";`
#[derive(Clone, Debug, PartialEq)]
pub struct Query {
    /// The name.
    pub name: Name,
    /// Names and types.
    pub parameters: Vec<(Name, Name)>,
    /// The text.
    pub text: Name,
}
