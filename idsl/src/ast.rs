//! The syntax tree of an `.idsl` file. Names are not resolved.

use rc_diagnostics::Span;
use rc_syntax::{Literal, Name};

/// A file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct File {
    /// `import "Other.idsl";`
    pub imports: Vec<Name>,
    /// The module. `None` after a syntax error.
    pub module: Option<Module>,
}

/// `module NAME { … };`
#[derive(Clone, Debug, PartialEq)]
pub struct Module {
    /// The name as declared.
    pub name: Name,
    /// The lines of its documentation.
    pub doc: Vec<String>,
    /// Annotations, `@…`.
    pub annotations: Vec<Annotation>,
    /// Declarations in the module, in the order of the file.
    pub decls: Vec<Decl>,
}

/// One declaration.
#[derive(Clone, Debug, PartialEq)]
pub struct Decl {
    /// The declared name.
    pub name: Name,
    /// The lines of its documentation.
    pub doc: Vec<String>,
    /// Annotations, `@…`.
    pub annotations: Vec<Annotation>,
    /// The kind of declaration, with its content.
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
    /// The name as declared.
    pub name: Name,
    /// The lines of its documentation.
    pub doc: Vec<String>,
    /// `= 3`
    pub value: Option<Literal>,
}

/// One member of a struct or an exception.
#[derive(Clone, Debug, PartialEq)]
pub struct Member {
    /// The name as declared.
    pub name: Name,
    /// The lines of its documentation.
    pub doc: Vec<String>,
    /// Annotations, `@…`.
    pub annotations: Vec<Annotation>,
    /// Type; an array's `[N]` is part of it.
    pub ty: Type,
    /// `= literal`
    pub default: Option<Literal>,
}

/// One operation of an interface.
#[derive(Clone, Debug, PartialEq)]
pub struct Operation {
    /// The name as declared.
    pub name: Name,
    /// The lines of its documentation.
    pub doc: Vec<String>,
    /// Annotations, `@…`.
    pub annotations: Vec<Annotation>,
    /// `idempotent`
    pub idempotent: bool,
    /// The keyword `command`, `query` or `publish`.
    pub pattern: Option<Name>,
    /// Return type, which may be `void`. Optional after a pattern.
    pub result: Option<Type>,
    /// Parameters, in their order.
    pub params: Vec<Param>,
    /// `throws A, B`
    pub throws: Vec<Scoped>,
}

/// One parameter of an operation.
#[derive(Clone, Debug, PartialEq)]
pub struct Param {
    /// The name as declared.
    pub name: Name,
    /// Annotations, `@…`.
    pub annotations: Vec<Annotation>,
    /// `out`
    pub out: bool,
    /// Type of the parameter.
    pub ty: Type,
}

/// A use of a type.
#[derive(Clone, Debug, PartialEq)]
pub struct Type {
    /// The form of the type.
    pub kind: TypeKind,
    /// The location of the use.
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

/// A name with an optional module: `Module::Name`.
#[derive(Clone, Debug, PartialEq)]
pub struct Scoped {
    /// The part before `::`.
    pub module: Option<Name>,
    /// The name itself.
    pub name: Name,
}

impl Scoped {
    /// The location of module and name.
    pub fn span(&self) -> Span {
        self.module
            .as_ref()
            .map_or(self.name.span, |m| m.span.to(self.name.span))
    }

    /// The name as written.
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
    /// The name after `@`.
    pub name: Name,
    /// Arguments, with optional names.
    pub args: Vec<(Option<Name>, Literal)>,
}
