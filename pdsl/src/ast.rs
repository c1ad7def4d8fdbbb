//! What stands in one `.pdsl` file, in its order, nothing resolved yet.

use rc_diagnostics::Span;
use rc_syntax::{Literal, Name};

/// A whole file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct File {
    /// `import "other.pdsl";`
    pub imports: Vec<Name>,
    /// The declaration, if one could be read.
    pub params: Option<Params>,
}

/// `ComponentParams NAME { … };`
#[derive(Clone, Debug, PartialEq)]
pub struct Params {
    /// Its name.
    pub name: Name,
    /// Its documentation.
    pub doc: Vec<String>,
    /// What is declared in it.
    pub items: Vec<Item>,
}

/// One declaration.
#[derive(Clone, Debug, PartialEq)]
pub enum Item {
    /// `device string "" T;`
    Param(Box<Param>),
    /// `group NAME { … };`
    Group(Group),
    /// `list NAME 1:8 { … };`
    List(List),
    /// `require condition "message";`
    Rule(Rule),
}

impl Item {
    /// The name that it declares; a rule declares none.
    pub fn name(&self) -> Option<&Name> {
        match self {
            Self::Param(param) => Some(&param.name),
            Self::Group(group) => Some(&group.name),
            Self::List(list) => Some(&list.name),
            Self::Rule(_) => None,
        }
    }
}

/// One parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct Param {
    /// Its name.
    pub name: Name,
    /// Its documentation.
    pub doc: Vec<String>,
    /// The word of its type.
    pub ty: Name,
    /// `[1:8]` or `[]` after the type.
    pub array: Option<Array>,
    /// Its default.
    pub default: Option<DefaultValue>,
    /// `0:127`
    pub range: Option<Range>,
    /// `{fast, slow}`
    pub choices: Vec<Literal>,
    /// What follows.
    pub flags: Vec<Flag>,
}

/// The mark of an array.
#[derive(Clone, Debug, PartialEq)]
pub struct Array {
    /// Its allowed length; none where any is.
    pub length: Option<Length>,
    /// Its place.
    pub span: Span,
}

/// `1:8`, the allowed length of an array or a list.
#[derive(Clone, Debug, PartialEq)]
pub struct Length {
    /// The shortest.
    pub min: Literal,
    /// The longest.
    pub max: Literal,
}

/// The value of a parameter that a configuration leaves out.
#[derive(Clone, Debug, PartialEq)]
pub enum DefaultValue {
    /// One value.
    One(Literal),
    /// `[1, 2, 3]`, and its place.
    Many(Vec<Literal>, Span),
}

impl DefaultValue {
    /// Its place.
    pub fn span(&self) -> Span {
        match self {
            Self::One(literal) => literal.span,
            Self::Many(_, span) => *span,
        }
    }
}

/// `0:127`, `0:`, `:127`
#[derive(Clone, Debug, PartialEq)]
pub struct Range {
    /// The smallest value.
    pub min: Option<Literal>,
    /// The largest value.
    pub max: Option<Literal>,
    /// Its place.
    pub span: Span,
}

/// One word after a parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct Flag {
    /// Which.
    pub kind: FlagKind,
    /// Where.
    pub span: Span,
}

/// The flags.
#[derive(Clone, Debug, PartialEq)]
pub enum FlagKind {
    /// `T`: may be changed while the component runs.
    Editable,
    /// `F`: fixed at start.
    Fixed,
    /// `unit "mm"`
    Unit(String),
    /// `restart`: a change takes effect at the next start.
    Restart,
    /// `secret`: never shown.
    Secret,
}

/// Parameters that belong together.
#[derive(Clone, Debug, PartialEq)]
pub struct Group {
    /// Its name.
    pub name: Name,
    /// Its documentation.
    pub doc: Vec<String>,
    /// What is declared in it.
    pub items: Vec<Item>,
}

/// A list of structures.
#[derive(Clone, Debug, PartialEq)]
pub struct List {
    /// Its name.
    pub name: Name,
    /// Its documentation.
    pub doc: Vec<String>,
    /// Its allowed length; none where any is.
    pub length: Option<Length>,
    /// What is declared in each of its elements.
    pub items: Vec<Item>,
}

/// A rule across parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct Rule {
    /// The condition as written, its comments left out and its white space folded.
    pub condition: String,
    /// What is said where it is broken.
    pub message: String,
    /// The place of the condition.
    pub span: Span,
}
