//! What stands in one `.pdsl` file, in its order, nothing resolved yet.

use rc_configuration::condition::Comparator;
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
    /// What has to hold.
    pub condition: Expression,
    /// The condition as written, its comments left out and its white space folded.
    pub text: String,
    /// What is said where it is broken.
    pub message: String,
}

/// A condition, or a part of one.
#[derive(Clone, Debug, PartialEq)]
pub struct Expression {
    /// What it is.
    pub kind: ExpressionKind,
    /// Its place.
    pub span: Span,
}

/// The parts of conditions. Chains like `a + b + c` are flat, so that only brackets nest.
#[derive(Clone, Debug, PartialEq)]
pub enum ExpressionKind {
    /// `3`, `50ms`, `"x"`, `true`
    Literal(Literal),
    /// `motors.max`; a single name may also be a choice.
    Path(Path),
    /// `max(motors.max)`
    Call(Name, Path),
    /// `-a`
    Negative(Box<Expression>),
    /// `not a`
    Not(Box<Expression>),
    /// `a + b - c`: each but the first with its operator before it.
    Sum(Box<Expression>, Vec<(SumOperator, Expression)>),
    /// `a * b / c`
    Product(Box<Expression>, Vec<(ProductOperator, Expression)>),
    /// `a < b`
    Comparison(Box<Expression>, Comparator, Box<Expression>),
    /// `a and b and c`
    All(Vec<Expression>),
    /// `a or b or c`
    Any(Vec<Expression>),
}

/// `motors.max`
#[derive(Clone, Debug, PartialEq)]
pub struct Path {
    /// Its names, at least one.
    pub names: Vec<Name>,
    /// Its place.
    pub span: Span,
}

impl Path {
    /// The first `count` names, with dots between them.
    pub fn text(&self, count: usize) -> String {
        let names = self.names.iter().take(count);
        let names: Vec<&str> = names.map(|name| name.text.as_str()).collect();
        names.join(".")
    }
}

/// What joins the parts of a sum.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SumOperator {
    /// `+`
    Add,
    /// `-`
    Subtract,
}

/// What joins the parts of a product.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ProductOperator {
    /// `*`
    Multiply,
    /// `/`
    Divide,
}
