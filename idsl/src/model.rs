//! Interfaces and types with every name resolved.

use crate::image::Image;
use rc_diagnostics::{SourceId, Span};
use rc_syntax::{Literal, Name};
use std::collections::HashMap;

/// Index of a type in [`Library::types`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct TypeId(pub usize);

/// Index of an interface in [`Library::interfaces`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct InterfaceId(pub usize);

/// Index of a module in [`Library::modules`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ModuleId(pub usize);

/// Everything that one component's imports reach.
#[derive(Clone, Debug, Default)]
pub struct Library {
    /// The modules, each after those that it imports.
    pub modules: Vec<Module>,
    /// All types of all modules.
    pub types: Vec<TypeDecl>,
    /// All interfaces of all modules.
    pub interfaces: Vec<Interface>,
}

/// One `.idsl` file.
#[derive(Clone, Debug)]
pub struct Module {
    /// The name after `module`.
    pub name: Name,
    /// Its documentation.
    pub doc: Vec<String>,
    /// The file.
    pub source: SourceId,
    /// The modules that it imports directly.
    pub imports: Vec<ModuleId>,
    /// Its types, in their order.
    pub types: Vec<TypeId>,
    /// The same, by their names.
    pub types_by_name: HashMap<String, TypeId>,
    /// Its interfaces, in their order.
    pub interfaces: Vec<InterfaceId>,
    /// Its constants, in their order.
    pub consts: Vec<Const>,
    /// `@ros("robot_msgs")`: its package in ROS 2, as it is written.
    pub ros_package: Option<Name>,
}

/// A constant.
#[derive(Clone, Debug)]
pub struct Const {
    /// Its name.
    pub name: Name,
    /// Its documentation.
    pub doc: Vec<String>,
    /// Its type, a primitive or a string.
    pub ty: Type,
    /// Its value.
    pub value: Literal,
}

/// A type with a name.
#[derive(Clone, Debug)]
pub struct TypeDecl {
    /// Its name.
    pub name: Name,
    /// Its module.
    pub module: ModuleId,
    /// Its documentation.
    pub doc: Vec<String>,
    /// What it is.
    pub kind: TypeDeclKind,
    /// How many levels of named types are inside of it.
    pub nesting_depth: u32,
    /// What it looks like in memory, where its size is known from the type alone: it is plain.
    pub image: Option<Image>,
    /// `@ros("sensor_msgs/msg/LaserScan")` on a structure: the type in ROS 2 that it is, as it is written.
    pub ros_type: Option<Name>,
}

/// The kinds of named types.
#[derive(Clone, Debug)]
pub enum TypeDeclKind {
    /// Values with names; an int32 on the wire.
    Enum(Vec<Enumerator>),
    /// Members in order.
    Struct(Vec<Member>),
    /// Members in order, those of the base first.
    Exception(Vec<Member>),
    /// Another name for a sequence or a dictionary.
    Alias(Type),
}

/// One value of an enum.
#[derive(Clone, Debug)]
pub struct Enumerator {
    /// Its name.
    pub name: Name,
    /// Its documentation.
    pub doc: Vec<String>,
    /// Its value on the wire.
    pub value: i32,
}

/// A member of a struct or an exception, or a parameter of an operation.
#[derive(Clone, Debug)]
pub struct Member {
    /// Its name.
    pub name: Name,
    /// Its documentation.
    pub doc: Vec<String>,
    /// Its type.
    pub ty: Type,
    /// `@optional`: there or not.
    pub optional: bool,
    /// `@unit("m/s")`
    pub unit: Option<String>,
    /// `@range(min=…, max=…)`, both ends allowed values.
    pub range: Option<Range>,
    /// `= value` or `@default(value)`
    pub default: Option<Literal>,
}

/// The allowed values of a number.
#[derive(Clone, Debug, PartialEq)]
pub struct Range {
    /// The smallest allowed value.
    pub min: Option<Literal>,
    /// The largest allowed value.
    pub max: Option<Literal>,
}

/// A type where it is used.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Type {
    /// `bool`, `int` …
    Primitive(Primitive),
    /// `string`, with the largest number of bytes if it is bounded.
    String(Option<u32>),
    /// A sequence, with the largest number of elements if it is bounded.
    Sequence(Box<Type>, Option<u32>),
    /// Exactly so many elements.
    Array(Box<Type>, u32),
    /// Pairs of key and value.
    Dictionary(Box<Type>, Box<Type>),
    /// A type with a name.
    Named(TypeId),
}

/// The types that have no parts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Primitive {
    /// `bool`
    Bool,
    /// `int8`
    I8,
    /// `byte`, `uint8`
    U8,
    /// `short`, `int16`
    I16,
    /// `uint16`
    U16,
    /// `int`, `int32`
    I32,
    /// `uint32`
    U32,
    /// `long`, `int64`
    I64,
    /// `uint64`
    U64,
    /// `float`, `float32`
    F32,
    /// `double`, `float64`
    F64,
}

impl Primitive {
    /// Every word that names a primitive type.
    pub const WORDS: [(&'static str, Primitive); 17] = [
        ("bool", Self::Bool),
        ("byte", Self::U8),
        ("short", Self::I16),
        ("int", Self::I32),
        ("long", Self::I64),
        ("float", Self::F32),
        ("double", Self::F64),
        ("int8", Self::I8),
        ("uint8", Self::U8),
        ("int16", Self::I16),
        ("uint16", Self::U16),
        ("int32", Self::I32),
        ("uint32", Self::U32),
        ("int64", Self::I64),
        ("uint64", Self::U64),
        ("float32", Self::F32),
        ("float64", Self::F64),
    ];

    /// The primitive that `word` names.
    pub fn from_word(word: &str) -> Option<Self> {
        Self::WORDS
            .iter()
            .find(|(name, _)| *name == word)
            .map(|(_, primitive)| *primitive)
    }

    /// Size on the wire and in memory, in bytes.
    pub fn size(self) -> u32 {
        match self {
            Self::Bool | Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }

    /// The smallest and the largest value of an integer type.
    pub fn integer_limits(self) -> Option<(i128, i128)> {
        Some(match self {
            Self::I8 => (i128::from(i8::MIN), i128::from(i8::MAX)),
            Self::U8 => (0, i128::from(u8::MAX)),
            Self::I16 => (i128::from(i16::MIN), i128::from(i16::MAX)),
            Self::U16 => (0, i128::from(u16::MAX)),
            Self::I32 => (i128::from(i32::MIN), i128::from(i32::MAX)),
            Self::U32 => (0, i128::from(u32::MAX)),
            Self::I64 => (i128::from(i64::MIN), i128::from(i64::MAX)),
            Self::U64 => (0, i128::from(u64::MAX)),
            Self::Bool | Self::F32 | Self::F64 => return None,
        })
    }

    /// Whether it is a floating-point type.
    pub fn is_float(self) -> bool {
        matches!(self, Self::F32 | Self::F64)
    }
}

/// The three patterns of communication.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Pattern {
    /// One to one, one way.
    Command,
    /// One to one, there and back.
    Query,
    /// One to many, one way.
    Publish,
}

impl Pattern {
    /// The word of the language.
    pub fn word(self) -> &'static str {
        match self {
            Self::Command => "command",
            Self::Query => "query",
            Self::Publish => "publish",
        }
    }
}

/// An interface.
#[derive(Clone, Debug)]
pub struct Interface {
    /// Its name.
    pub name: Name,
    /// Its module.
    pub module: ModuleId,
    /// Its documentation.
    pub doc: Vec<String>,
    /// Its operations, in their order.
    pub operations: Vec<Operation>,
}

/// An operation of an interface.
#[derive(Clone, Debug)]
pub struct Operation {
    /// Its name.
    pub name: Name,
    /// Its documentation.
    pub doc: Vec<String>,
    /// The pattern that is written before it.
    pub explicit_pattern: Option<Pattern>,
    /// `idempotent`
    pub idempotent: bool,
    /// What it returns.
    pub result: Option<Type>,
    /// Parameters that go in.
    pub inputs: Vec<Member>,
    /// Parameters that come out.
    pub outputs: Vec<Member>,
    /// Exceptions that it may answer with.
    pub throws: Vec<TypeId>,
    /// `@ros("std_srvs/srv/Trigger")`: its types in ROS 2, as they are written: of its topic, of its service.
    pub ros_types: Vec<Name>,
}

impl Operation {
    /// Whether something comes back: a value, an `out` parameter or an exception.
    pub fn has_result(&self) -> bool {
        self.result.is_some() || !self.outputs.is_empty() || !self.throws.is_empty()
    }

    /// Its pattern where its interface is implemented or required.
    pub fn call_pattern(&self) -> Pattern {
        match self.explicit_pattern {
            Some(pattern) => pattern,
            None if self.has_result() => Pattern::Query,
            None => Pattern::Command,
        }
    }
}

impl Type {
    /// The named types that stand in it, as often as they do.
    pub fn named(&self) -> Vec<TypeId> {
        match self {
            Self::Named(id) => vec![*id],
            Self::Sequence(element, _) | Self::Array(element, _) => element.named(),
            Self::Dictionary(key, value) => [key.named(), value.named()].concat(),
            Self::Primitive(_) | Self::String(_) => Vec::new(),
        }
    }
}

impl Library {
    /// The named types that stand in what is declared as `id`.
    pub fn named_in(&self, id: TypeId) -> Vec<TypeId> {
        match &self.ty(id).kind {
            TypeDeclKind::Enum(_) => Vec::new(),
            TypeDeclKind::Struct(members) | TypeDeclKind::Exception(members) => {
                members.iter().flat_map(|m| m.ty.named()).collect()
            }
            TypeDeclKind::Alias(ty) => ty.named(),
        }
    }

    /// The named type.
    pub fn ty(&self, id: TypeId) -> &TypeDecl {
        &self.types[id.0]
    }

    /// The interface.
    pub fn interface(&self, id: InterfaceId) -> &Interface {
        &self.interfaces[id.0]
    }

    /// The module.
    pub fn module(&self, id: ModuleId) -> &Module {
        &self.modules[id.0]
    }

    /// `Module::Name` of a type.
    pub fn type_path(&self, id: TypeId) -> String {
        let decl = self.ty(id);
        format!("{}::{}", self.module(decl.module).name.text, decl.name.text)
    }

    /// `Module::Name` of an interface.
    pub fn interface_path(&self, id: InterfaceId) -> String {
        let interface = self.interface(id);
        format!(
            "{}::{}",
            self.module(interface.module).name.text,
            interface.name.text
        )
    }

    /// The type behind aliases.
    pub fn resolved<'a>(&'a self, ty: &'a Type) -> &'a Type {
        match ty {
            Type::Named(id) => match &self.ty(*id).kind {
                TypeDeclKind::Alias(inner) => self.resolved(inner),
                _ => ty,
            },
            _ => ty,
        }
    }

    /// The modules that `module` reaches by imports, itself included.
    pub fn reachable(&self, module: ModuleId) -> Vec<ModuleId> {
        let mut seen = vec![module];
        let mut next = 0;
        while next < seen.len() {
            for import in &self.modules[seen[next].0].imports {
                if !seen.contains(import) {
                    seen.push(*import);
                }
            }
            next += 1;
        }
        seen
    }
}

impl Module {
    /// Where the module's name stands.
    pub fn span(&self) -> Span {
        self.name.span
    }
}
