//! The syntax tree of a `.dproto` file. Names are not resolved.

use rc_diagnostics::Span;
use rc_syntax::Name;

/// A file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct File {
    /// Declarations, in the order of the file.
    pub items: Vec<Item>,
}

/// A declaration.
#[derive(Clone, Debug, PartialEq)]
pub struct Item {
    /// Its place, without a comment before it.
    pub span: Span,
    /// The declaration.
    pub kind: ItemKind,
}

/// The kinds of declarations.
#[derive(Clone, Debug, PartialEq)]
pub enum ItemKind {
    /// `import "Lidar.idsl";`
    Import(Name),
    /// `axes robocomp :: right, ahead, up`
    Axes(Name, Vec<Name>),
    /// `algebraic position :: Scalar{x, y, z}`
    Algebraic(Name, Shape),
    /// `ddr point :: ROS{geometry_msgs/Point}`
    Ddr(Name, Representation),
    /// `units metres :: qudt, position { x = m }`: name, vocabulary, algebraic, units.
    Units(Name, Name, Name, Map),
    /// `alias a <-> b { 0 = x }`
    Alias(Name, Name, Map),
    /// `view pose.Position -> position { {0,3} = 0 }`
    View(Name, Name, Name, Map),
    /// `conversion a -> b = f`
    Conversion(Name, Name, Name),
    /// `load LIBRARY`
    Load(Name),
    /// `fproto f :: c99 { … }`
    Function(Name, Option<Name>, Vec<Field>),
    /// `domain soil :: { … }`
    Domain(Name, Vec<Field>),
    /// `dproto point :: geometry { … }`
    Prototype(Name, Name, Vec<Field>),
}

/// An abstract type: how values are named.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// `Scalar{x, y, z}`
    Scalar(Vec<Name>),
    /// `Vector{3}`
    Vector(Name),
    /// `Matrix{3, 3}`: rows and columns.
    Matrix(Name, Name),
}

/// A type of a language or of an interface: `c99{double[3]}`.
#[derive(Clone, Debug, PartialEq)]
pub struct Representation {
    /// The language: `c99`, `ROS`, `IDSL` …
    pub language: Name,
    /// The type in it.
    pub model: Name,
}

/// `name = value`
#[derive(Clone, Debug, PartialEq)]
pub struct Field {
    /// Its place, without a comma.
    pub span: Span,
    /// The name.
    pub name: Name,
    /// The value.
    pub value: Value,
}

/// The value of a field.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// `:: c99{double[3]}`
    Representation(Representation),
    /// `{ … }`
    Map(Map),
    /// One of the others.
    Operand(Operand),
}

/// `{ x = 0, y = 1 }`
#[derive(Clone, Debug, PartialEq)]
pub struct Map {
    /// Its place, with the braces.
    pub span: Span,
    /// Its contents.
    pub entries: Vec<Entry>,
}

/// `x = 0`, or one side only.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// Its place, without a comma.
    pub span: Span,
    /// The left side.
    pub left: Operand,
    /// `=`, `<=` or `=>`, and the right side.
    pub right: Option<(Name, Operand)>,
    /// Where a `-` stands before the right side.
    pub minus: Option<Span>,
}

/// One side of an entry.
#[derive(Clone, Debug, PartialEq)]
pub struct Operand {
    /// Its place.
    pub span: Span,
    /// What it is.
    pub kind: OperandKind,
}

/// The kinds of sides.
#[derive(Clone, Debug, PartialEq)]
pub enum OperandKind {
    /// A name, a path with dots, or a number.
    Symbol(String),
    /// `member header.frame`: a member of the message.
    Member(String),
    /// A quoted text.
    Text(String),
    /// `{0, 1}`: row and column.
    Index(Vec<String>),
}

impl Operand {
    /// The text without quotes and blanks: `x`, `0`, `{0,1}`.
    pub fn text(&self) -> String {
        match &self.kind {
            OperandKind::Symbol(text) | OperandKind::Text(text) => text.clone(),
            OperandKind::Member(path) => format!("member {path}"),
            OperandKind::Index(numbers) => format!("{{{}}}", numbers.join(",")),
        }
    }
}

impl Value {
    /// Where it is.
    pub fn span(&self) -> Span {
        match self {
            Self::Representation(of) => of.language.span.to(of.model.span),
            Self::Map(map) => map.span,
            Self::Operand(operand) => operand.span,
        }
    }
}
