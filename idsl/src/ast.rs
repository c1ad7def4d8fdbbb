//! What stands in one `.idsl` file, in its order, nothing resolved yet.

use rc_diagnostics::Span;
use rc_syntax::{Literal, Name};

/// A whole file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct File {
    /// `import "Other.idsl";`
    pub imports: Vec<Name>,
    /// The module, if one could be read.
    pub module: Option<Module>,
}

/// `module NAME { … };`
#[derive(Clone, Debug, PartialEq)]
pub struct Module {
    /// Its name.
    pub name: Name,
    /// Its documentation.
    pub doc: Vec<String>,
    /// `@…` before it.
    pub annotations: Vec<Annotation>,
    /// Its declarations.
    pub decls: Vec<Decl>,
}

/// One declaration.
#[derive(Clone, Debug, PartialEq)]
pub struct Decl {
    /// What it declares.
    pub name: Name,
    /// Its documentation.
    pub doc: Vec<String>,
    /// `@…` before it.
    pub annotations: Vec<Annotation>,
    /// What kind of thing it is.
    pub kind: DeclKind,
}

/// The kinds of declarations.
#[derive(Clone, Debug, PartialEq)]
pub enum DeclKind {
    /// `enum`
    Enum(Vec<Enumerator>),
    /// `struct`
    Struct(Vec<Member>),
    /// `exception NAME [extends NAME]`
    Exception(Option<Scoped>, Vec<Member>),
    /// `sequence<T> NAME;` and `dictionary<K, V> NAME;`
    Alias(Type),
    /// `const`
    Const(Type, Literal),
    /// `interface`
    Interface(Vec<Operation>),
}

/// One value of an enum.
#[derive(Clone, Debug, PartialEq)]
pub struct Enumerator {
    /// Its name.
    pub name: Name,
    /// Its documentation.
    pub doc: Vec<String>,
    /// `= 3`
    pub value: Option<Literal>,
}

/// One member of a struct or an exception.
#[derive(Clone, Debug, PartialEq)]
pub struct Member {
    /// Its name.
    pub name: Name,
    /// Its documentation.
    pub doc: Vec<String>,
    /// `@…` before it.
    pub annotations: Vec<Annotation>,
    /// Its type; an array's `[N]` is part of it.
    pub ty: Type,
    /// `= literal`
    pub default: Option<Literal>,
}

/// One operation of an interface.
#[derive(Clone, Debug, PartialEq)]
pub struct Operation {
    /// Its name.
    pub name: Name,
    /// Its documentation.
    pub doc: Vec<String>,
    /// `@…` before it.
    pub annotations: Vec<Annotation>,
    /// `idempotent`
    pub idempotent: bool,
    /// `command`, `query` or `publish` before it.
    pub pattern: Option<Name>,
    /// Its return type, `void` included; none where it was left out.
    pub result: Option<Type>,
    /// Its parameters.
    pub params: Vec<Param>,
    /// `throws A, B`
    pub throws: Vec<Scoped>,
}

/// One parameter of an operation.
#[derive(Clone, Debug, PartialEq)]
pub struct Param {
    /// Its name.
    pub name: Name,
    /// `@…` before it.
    pub annotations: Vec<Annotation>,
    /// `out`
    pub out: bool,
    /// Its type.
    pub ty: Type,
}

/// A type where it is used.
#[derive(Clone, Debug, PartialEq)]
pub struct Type {
    /// What it is.
    pub kind: TypeKind,
    /// Where it is used.
    pub span: Span,
}

/// The forms of types.
#[derive(Clone, Debug, PartialEq)]
pub enum TypeKind {
    /// `int`, `TData`, `Other::TData`
    Named(Scoped),
    /// `string` and `string<64>`
    String(Option<Literal>),
    /// `sequence<T>` and `sequence<T, 64>`
    Sequence(Box<Type>, Option<Literal>),
    /// `dictionary<K, V>`
    Dictionary(Box<Type>, Box<Type>),
    /// `T name[16]`
    Array(Box<Type>, Literal),
}

/// A name, perhaps with its module.
#[derive(Clone, Debug, PartialEq)]
pub struct Scoped {
    /// The part before `::`.
    pub module: Option<Name>,
    /// The name itself.
    pub name: Name,
}

impl Scoped {
    /// The whole place.
    pub fn span(&self) -> Span {
        self.module
            .as_ref()
            .map_or(self.name.span, |m| m.span.to(self.name.span))
    }

    /// As it was written.
    pub fn text(&self) -> String {
        match &self.module {
            Some(module) => format!("{}::{}", module.text, self.name.text),
            None => self.name.text.clone(),
        }
    }
}

/// `@unit("m/s")`, `@range(min=0, max=100)`
#[derive(Clone, Debug, PartialEq)]
pub struct Annotation {
    /// The word after `@`.
    pub name: Name,
    /// Its arguments, each perhaps with a name.
    pub args: Vec<(Option<Name>, Literal)>,
}
