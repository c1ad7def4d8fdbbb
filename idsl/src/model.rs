//! The model of IDSL: interfaces and types with all names resolved.

use rc_diagnostics::{SourceId, Span};
use rc_syntax::{Literal, Name};
pub use rc_vocabulary::{Layout, Pattern, Primitive};
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

/// All modules that a component imports, directly or indirectly.
#[derive(Clone, Debug, Default)]
pub struct Library {
    /// The modules. Each module is after the modules it imports.
    pub modules: Vec<Module>,
    /// All types of all modules.
    pub types: Vec<TypeDecl>,
    /// All interfaces of all modules.
    pub interfaces: Vec<Interface>,
    /// Where files name modules and types, also the file that imports the first module.
    pub references: Vec<(Span, Reference)>,
}

/// What a name in a file refers to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reference {
    /// An import, or the part before `::`.
    Module(ModuleId),
    /// The use of a type.
    Type(TypeId),
}

/// One `.idsl` file.
#[derive(Clone, Debug)]
pub struct Module {
    /// The name after `module`.
    pub name: Name,
    /// The lines of its documentation.
    pub doc: Vec<String>,
    /// The file that declares the module.
    pub source: SourceId,
    /// The directly imported modules.
    pub imports: Vec<ModuleId>,
    /// The types, in the order of the file.
    pub types: Vec<TypeId>,
    /// The types by name.
    pub types_by_name: HashMap<String, TypeId>,
    /// The interfaces, in the order of the file.
    pub interfaces: Vec<InterfaceId>,
    /// The constants, in the order of the file.
    pub consts: Vec<Const>,
    /// `@ros("robot_msgs")`: the ROS 2 package of the module, as written.
    pub ros_package: Option<Name>,
}

/// A constant.
#[derive(Clone, Debug)]
pub struct Const {
    /// The name as declared.
    pub name: Name,
    /// The lines of its documentation.
    pub doc: Vec<String>,
    /// Type, a primitive or a string.
    pub ty: Type,
    /// Value of the constant.
    pub value: Literal,
}

/// A named type.
#[derive(Clone, Debug)]
pub struct TypeDecl {
    /// The name as declared.
    pub name: Name,
    /// Module of the declaration.
    pub module: ModuleId,
    /// The lines of its documentation.
    pub doc: Vec<String>,
    /// The kind of type, with its content.
    pub kind: TypeDeclKind,
    /// The levels of named types inside it. 0 if it contains none.
    pub nesting_depth: u32,
    /// The memory image of a plain type. `None` if the type does not determine its size.
    pub image: Option<Layout>,
    /// `@ros("sensor_msgs/msg/LaserScan")` on a struct: its ROS 2 type, as written.
    pub ros_type: Option<Name>,
    /// `@dproto("point")` on a struct: its data prototype.
    pub prototype: Option<Name>,
}

/// The kinds of named types.
#[derive(Clone, Debug)]
pub enum TypeDeclKind {
    /// Named values, an int32 on the wire.
    Enum(Vec<Enumerator>),
    /// Members in order.
    Struct(Vec<Member>),
    /// Members in order, starting with those of the base.
    Exception(Vec<Member>),
    /// Another name for a sequence or a dictionary.
    Alias(Type),
}

/// One value of an enum.
#[derive(Clone, Debug)]
pub struct Enumerator {
    /// The name as declared.
    pub name: Name,
    /// The lines of its documentation.
    pub doc: Vec<String>,
    /// Value on the wire.
    pub value: i32,
}

/// A member of a struct or an exception, or a parameter of an operation.
#[derive(Clone, Debug)]
pub struct Member {
    /// The name as declared.
    pub name: Name,
    /// The lines of its documentation.
    pub doc: Vec<String>,
    /// Type of the member or parameter.
    pub ty: Type,
    /// `@optional`
    pub optional: bool,
    /// `@stamp`: programs outside copy it from what they receive to what they send.
    pub stamp: bool,
    /// `@unit("m/s")`
    pub unit: Option<String>,
    /// `@dproto("point")`: the data prototype of its type.
    pub prototype: Option<Name>,
    /// `@range(min=…, max=…)`, limits included.
    pub range: Option<Range>,
    /// `= value` or `@default(value)`
    pub default: Option<Literal>,
}

impl Member {
    /// A member without documentation and annotations.
    pub fn plain(name: Name, ty: Type) -> Self {
        Self {
            name,
            doc: Vec::new(),
            ty,
            optional: false,
            stamp: false,
            unit: None,
            prototype: None,
            range: None,
            default: None,
        }
    }
}

/// The allowed values of a number.
#[derive(Clone, Debug, PartialEq)]
pub struct Range {
    /// The minimum. `None` if unlimited.
    pub min: Option<Literal>,
    /// The maximum. `None` if unlimited.
    pub max: Option<Literal>,
}

/// A use of a type.
pub type Type = rc_vocabulary::Type<TypeId>;

/// An interface.
#[derive(Clone, Debug)]
pub struct Interface {
    /// The name as declared.
    pub name: Name,
    /// Module of the declaration.
    pub module: ModuleId,
    /// The lines of its documentation.
    pub doc: Vec<String>,
    /// Operations, in their order.
    pub operations: Vec<Operation>,
}

/// An operation of an interface.
#[derive(Clone, Debug)]
pub struct Operation {
    /// The name as declared.
    pub name: Name,
    /// The lines of its documentation.
    pub doc: Vec<String>,
    /// The pattern keyword before it, if any.
    pub explicit_pattern: Option<Pattern>,
    /// `idempotent`
    pub idempotent: bool,
    /// The return type. `None` for `void`.
    pub result: Option<Type>,
    /// Input parameters.
    pub inputs: Vec<Member>,
    /// `out` parameters.
    pub outputs: Vec<Member>,
    /// The exceptions it may throw.
    pub throws: Vec<TypeId>,
    /// `@ros("std_srvs/srv/Trigger")`: its ROS 2 types, of the topic and of the service, as
    /// written.
    pub ros_types: Vec<Name>,
    /// The allowed values of the result: an `@range` before the operation.
    pub result_range: Option<Range>,
}

impl Operation {
    /// Whether it has a return value, an `out` parameter or an exception.
    pub fn has_result(&self) -> bool {
        self.result.is_some() || !self.outputs.is_empty() || !self.throws.is_empty()
    }

    /// Pattern in an interface that a component implements or requires.
    pub fn call_pattern(&self) -> Pattern {
        match self.explicit_pattern {
            Some(pattern) => pattern,
            None if self.has_result() => Pattern::Query,
            None => Pattern::Command,
        }
    }
}

impl Library {
    /// The named types that the declaration of `id` mentions directly, with repetitions.
    pub fn named_in(&self, id: TypeId) -> Vec<TypeId> {
        match &self.ty(id).kind {
            TypeDeclKind::Enum(_) => Vec::new(),
            TypeDeclKind::Struct(members) | TypeDeclKind::Exception(members) => {
                members.iter().flat_map(|m| m.ty.names()).copied().collect()
            }
            TypeDeclKind::Alias(ty) => ty.names().into_iter().copied().collect(),
        }
    }

    /// Looks up a type.
    pub fn ty(&self, id: TypeId) -> &TypeDecl {
        &self.types[id.0]
    }

    /// Looks up an interface.
    pub fn interface(&self, id: InterfaceId) -> &Interface {
        &self.interfaces[id.0]
    }

    /// Looks up a module.
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

    /// The type itself, or the one that an alias resolves to.
    pub fn resolved<'a>(&'a self, ty: &'a Type) -> &'a Type {
        match ty {
            Type::Named(id) => match &self.ty(*id).kind {
                TypeDeclKind::Alias(inner) => self.resolved(inner),
                TypeDeclKind::Enum(_) | TypeDeclKind::Struct(_) | TypeDeclKind::Exception(_) => ty,
            },
            Type::Primitive(_)
            | Type::Text { .. }
            | Type::Sequence { .. }
            | Type::Array { .. }
            | Type::Dictionary { .. } => ty,
        }
    }

    /// The type with all aliases in it resolved.
    pub fn unaliased(&self, ty: &Type) -> Type {
        let unaliased: Result<_, std::convert::Infallible> =
            ty.replace(&mut |id| match &self.ty(*id).kind {
                TypeDeclKind::Alias(inner) => Ok(self.unaliased(inner)),
                TypeDeclKind::Enum(_) | TypeDeclKind::Struct(_) | TypeDeclKind::Exception(_) => {
                    Ok(Type::Named(*id))
                }
            });
        match unaliased {
            Ok(unaliased) => unaliased,
        }
    }

    /// `module` and all modules it imports, directly or indirectly.
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
    /// The location of the module's name.
    pub fn span(&self) -> Span {
        self.name.span
    }
}
