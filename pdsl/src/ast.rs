//! The syntax tree of one `.pdsl` file, in the order of the text. Names are not resolved.

use rc_configuration::condition::Comparator;
use rc_diagnostics::Span;
use rc_syntax::{Literal, Name};

/// A whole file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct File {
    /// `import "other.pdsl";`
    pub imports: Vec<Name>,
    /// The declaration, unless it is missing or unreadable.
    pub params: Option<Params>,
}

/// `ComponentParams NAME { … };`
#[derive(Clone, Debug, PartialEq)]
pub struct Params {
    /// The name.
    pub name: Name,
    /// The documentation, line by line.
    pub doc: Vec<String>,
    /// The declarations in it.
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
    /// A declaration with a syntax error: its name, and the word where a parameter has its type.
    Broken(Name, Option<Name>),
}

impl Item {
    /// The declared name. A rule declares none.
    pub fn name(&self) -> Option<&Name> {
        match self {
            Self::Param(param) => Some(&param.name),
            Self::Group(group) => Some(&group.name),
            Self::List(list) => Some(&list.name),
            Self::Rule(_) | Self::Broken(..) => None,
        }
    }
}

/// One parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct Param {
    /// The name.
    pub name: Name,
    /// The documentation, line by line.
    pub doc: Vec<String>,
    /// The name of the type.
    pub ty: Name,
    /// `[1:8]` or `[]` after the type.
    pub array: Option<Array>,
    /// The default.
    pub default: Option<DefaultValue>,
    /// `0:127`
    pub range: Option<Range>,
    /// `{fast, slow}`
    pub choices: Vec<Literal>,
    /// The flags, in the order of the text.
    pub flags: Vec<Flag>,
}

/// The brackets of an array.
#[derive(Clone, Debug, PartialEq)]
pub struct Array {
    /// The allowed length; `None` for any length.
    pub length: Option<Length>,
    /// The location.
    pub span: Span,
}

/// `1:8`, the allowed length of an array or a list.
#[derive(Clone, Debug, PartialEq)]
pub struct Length {
    /// The minimum.
    pub min: Literal,
    /// The maximum.
    pub max: Literal,
}

/// The default of a parameter.
#[derive(Clone, Debug, PartialEq)]
pub enum DefaultValue {
    /// One value.
    One(Literal),
    /// `[1, 2, 3]`, with its location.
    Many(Vec<Literal>, Span),
}

impl DefaultValue {
    /// The location.
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
    /// The minimum.
    pub min: Option<Literal>,
    /// The maximum.
    pub max: Option<Literal>,
    /// The location.
    pub span: Span,
}

/// A flag of a parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct Flag {
    /// The kind of flag.
    pub kind: FlagKind,
    /// The location.
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
    /// `reads "innermodel"`: the component reads the file when it starts.
    Reads(Name),
    /// `element "joint" of inner_model`: kind of an element, and the parameter that names its file.
    Element(Name, Name),
}

/// A group of parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct Group {
    /// The name.
    pub name: Name,
    /// The documentation, line by line.
    pub doc: Vec<String>,
    /// The declarations in it.
    pub items: Vec<Item>,
}

/// A list of structures.
#[derive(Clone, Debug, PartialEq)]
pub struct List {
    /// The name.
    pub name: Name,
    /// The documentation, line by line.
    pub doc: Vec<String>,
    /// The allowed length; `None` for any length.
    pub length: Option<Length>,
    /// The declarations in each element.
    pub items: Vec<Item>,
}

/// A rule across parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct Rule {
    /// The condition that must hold.
    pub condition: Expression,
    /// The text of the condition, without comments and with folded white space.
    pub text: String,
    /// The message if the condition does not hold.
    pub message: String,
}

/// A condition, or a part of one.
#[derive(Clone, Debug, PartialEq)]
pub struct Expression {
    /// The kind of expression.
    pub kind: ExpressionKind,
    /// The location.
    pub span: Span,
}

impl Expression {
    /// Adds all paths in it, in the order of the text.
    pub fn paths<'e>(&'e self, out: &mut Vec<&'e Path>) {
        match &self.kind {
            ExpressionKind::Literal(_) => {}
            ExpressionKind::Path(path) | ExpressionKind::Call(_, path) => out.push(path),
            ExpressionKind::Negative(inner) | ExpressionKind::Not(inner) => inner.paths(out),
            ExpressionKind::Sum(first, rest) => {
                first.paths(out);
                rest.iter().for_each(|(_, part)| part.paths(out));
            }
            ExpressionKind::Product(first, rest) => {
                first.paths(out);
                rest.iter().for_each(|(_, part)| part.paths(out));
            }
            ExpressionKind::Comparison(left, _, right) => {
                left.paths(out);
                right.paths(out);
            }
            ExpressionKind::All(parts) | ExpressionKind::Any(parts) => {
                parts.iter().for_each(|part| part.paths(out));
            }
        }
    }
}

/// The kinds of expressions. Chains such as `a + b + c` are flat, so that only brackets nest.
#[derive(Clone, Debug, PartialEq)]
pub enum ExpressionKind {
    /// `3`, `50ms`, `"x"`, `true`
    Literal(Literal),
    /// `motors.max`. A single name may also be a choice.
    Path(Path),
    /// `max(motors.max)`
    Call(Name, Path),
    /// `-a`
    Negative(Box<Expression>),
    /// `not a`
    Not(Box<Expression>),
    /// `a + b - c`. Each part but the first has its operator.
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
    /// The names, at least one.
    pub names: Vec<Name>,
    /// The location.
    pub span: Span,
}

impl Path {
    /// The first `count` names, joined by dots.
    pub fn text(&self, count: usize) -> String {
        let names = self.names.iter().take(count);
        let names: Vec<&str> = names.map(|name| name.text.as_str()).collect();
        names.join(".")
    }
}

/// The operators of a sum.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SumOperator {
    /// `+`
    Add,
    /// `-`
    Subtract,
}

/// The operators of a product.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ProductOperator {
    /// `*`
    Multiply,
    /// `/`
    Divide,
}
