//! The types and interfaces of IDSL modules, neutral of the language that they are printed in.

use super::checks::{self, Check};
use super::description;
use super::in_place::{self, Structure};
use super::members::{Member, Value, member, value};
use super::types::{Type, named, of_type};
use rc_idsl::Library;
use rc_idsl::model::{self, InterfaceId, ModuleId, Pattern, TypeDeclKind, TypeId};
use serde::Serialize;

/// One IDSL module.
#[derive(Debug, Serialize)]
pub struct Module {
    /// The name after `module`.
    pub name: String,
    /// Lines of documentation.
    pub doc: Vec<String>,
    /// The constants, in the order of the text.
    pub constants: Vec<Constant>,
    /// The types, in the order of the text.
    pub types: Vec<TypeDecl>,
    /// The interfaces, in the order of the text.
    pub interfaces: Vec<Interface>,
    /// Description for tools of a running component: `rc_values::description` as JSON.
    pub description: String,
}

/// A constant.
#[derive(Debug, Serialize)]
pub struct Constant {
    /// The name in the IDSL.
    pub name: String,
    /// Lines of documentation.
    pub doc: Vec<String>,
    /// A primitive type or a text.
    #[serde(rename = "type")]
    pub ty: Type,
    /// The value.
    pub value: Value,
}

/// A type with a name.
#[derive(Debug, Serialize)]
pub struct TypeDecl {
    /// The name in the IDSL.
    pub name: String,
    /// Lines of documentation.
    pub doc: Vec<String>,
    /// Kind of the type, with its content.
    #[serde(flatten)]
    pub kind: Kind,
    /// The structures that hold values of this type in shared memory, each after those that it
    /// contains. Empty for a type whose size depends on its value.
    pub in_place: Vec<Structure>,
}

/// The kinds of named types.
#[derive(Debug, Serialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
pub enum Kind {
    /// Numbers with names; an int32 on the wire.
    Enum {
        /// The enumerators.
        values: Vec<Enumerator>,
    },
    /// Members in order.
    Struct {
        /// The members.
        members: Vec<Member>,
    },
    /// An error that an operation may answer with.
    Exception {
        /// The members, those of the base first.
        members: Vec<Member>,
    },
    /// Another name for a type.
    Alias {
        /// This type.
        target: Type,
    },
}

/// An enumerator.
#[derive(Debug, Serialize)]
pub struct Enumerator {
    /// The name in the IDSL.
    pub name: String,
    /// Lines of documentation.
    pub doc: Vec<String>,
    /// The number on the wire.
    pub number: i32,
}

/// An interface.
#[derive(Debug, Serialize)]
pub struct Interface {
    /// The name in the IDSL.
    pub name: String,
    /// Module that declares the interface.
    pub module: String,
    /// Lines of documentation.
    pub doc: Vec<String>,
    /// Whether components may implement and require it.
    pub calls: bool,
    /// Whether components may publish it and subscribe to it.
    pub topics: bool,
    /// The operations, in the order of the text.
    pub operations: Vec<Operation>,
}

/// An operation.
#[derive(Debug, Serialize)]
pub struct Operation {
    /// The name in the IDSL.
    pub name: String,
    /// Lines of documentation.
    pub doc: Vec<String>,
    /// The hash of the name, which is the discriminator in the envelope of a call.
    pub id: i32,
    /// The hash of the types, sixteen hexadecimal digits.
    pub type_hash: String,
    /// Whether a call waits for a reply.
    pub two_way: bool,
    /// The parameters that go in.
    pub inputs: Vec<Member>,
    /// The parameters that come out.
    pub outputs: Vec<Member>,
    /// The type of the returned value.
    pub result: Option<Type>,
    /// Checks of writers and readers of the returned value.
    pub result_checks: Vec<Check>,
    /// The exceptions that a reply may hold.
    pub throws: Vec<Exception>,
    /// The type of the only parameter, where a sample of the topic can travel in place.
    pub sample_in_place: Option<Type>,
    /// The type of the only result, where it can travel in place.
    pub result_in_place: Option<Type>,
}

/// An exception of an operation.
#[derive(Debug, Serialize)]
pub struct Exception {
    /// Structure of the exception.
    #[serde(rename = "type")]
    pub ty: Type,
    /// The hash of its name, which is the discriminator in the envelope of a reply.
    pub id: i32,
}

/// The view of all modules of a library.
pub fn of(library: &Library) -> Vec<Module> {
    let mut known = in_place::Known::new();
    (0..library.modules.len())
        .map(|at| module(library, ModuleId(at), &mut known))
        .collect()
}

fn module(library: &Library, id: ModuleId, known: &mut in_place::Known) -> Module {
    let module = library.module(id);
    let constants = module.consts.iter().map(|constant| Constant {
        name: constant.name.text.clone(),
        doc: constant.doc.clone(),
        ty: of_type(library, &constant.ty),
        value: value(library, &constant.ty, &constant.value),
    });
    Module {
        name: module.name.text.clone(),
        doc: module.doc.clone(),
        constants: constants.collect(),
        types: module
            .types
            .iter()
            .map(|id| decl(library, *id, known))
            .collect(),
        interfaces: module
            .interfaces
            .iter()
            .map(|id| interface(library, *id))
            .collect(),
        description: description::of(library, id).text(),
    }
}

fn decl(library: &Library, id: TypeId, known: &mut in_place::Known) -> TypeDecl {
    let decl = library.ty(id);
    let members = |members: &[model::Member]| members.iter().map(|m| member(library, m)).collect();
    TypeDecl {
        name: decl.name.text.clone(),
        doc: decl.doc.clone(),
        kind: match &decl.kind {
            TypeDeclKind::Enum(values) => Kind::Enum {
                values: values
                    .iter()
                    .map(|value| Enumerator {
                        name: value.name.text.clone(),
                        doc: value.doc.clone(),
                        number: value.value,
                    })
                    .collect(),
            },
            TypeDeclKind::Struct(all) => Kind::Struct {
                members: members(all),
            },
            TypeDeclKind::Exception(all) => Kind::Exception {
                members: members(all),
            },
            TypeDeclKind::Alias(target) => Kind::Alias {
                target: of_type(library, target),
            },
        },
        in_place: in_place::of(library, id, known),
    }
}

fn interface(library: &Library, id: InterfaceId) -> Interface {
    let interface = library.interface(id);
    let mut operations = interface.operations.iter();
    let calls = operations.all(|o| o.explicit_pattern != Some(Pattern::Publish));
    let mut operations = interface.operations.iter();
    let is_topic = |o: &model::Operation| match o.explicit_pattern {
        Some(pattern) => pattern == Pattern::Publish,
        None => !o.has_result(),
    };
    let topics = !interface.operations.is_empty() && operations.all(is_topic);
    Interface {
        name: interface.name.text.clone(),
        module: library.module(interface.module).name.text.clone(),
        doc: interface.doc.clone(),
        calls,
        topics,
        operations: interface
            .operations
            .iter()
            .map(|o| operation(library, id, o))
            .collect(),
    }
}

fn operation(library: &Library, id: InterfaceId, operation: &model::Operation) -> Operation {
    let two_way = operation.call_pattern() == Pattern::Query;
    let members = |all: &[model::Member]| all.iter().map(|m| member(library, m)).collect();
    let exception = |id: &TypeId| Exception {
        ty: named(library, *id),
        id: super::rpc_hash::of(&library.ty(*id).name.text),
    };
    let sample = operation.topic_in_place(library).filter(|_| !two_way);
    let result = operation.result_in_place(library).filter(|_| two_way);
    Operation {
        name: operation.name.text.clone(),
        doc: operation.doc.clone(),
        id: super::rpc_hash::of(&operation.name.text),
        type_hash: format!(
            "{:016x}",
            rc_idsl::canonical::operation_hash(library, id, operation)
        ),
        two_way,
        inputs: members(&operation.inputs),
        outputs: members(&operation.outputs),
        result: operation.result.as_ref().map(|ty| of_type(library, ty)),
        result_checks: operation
            .result
            .as_ref()
            .map(|ty| checks::of_value(library, ty, operation.result_range.as_ref()))
            .unwrap_or_default(),
        throws: operation.throws.iter().map(exception).collect(),
        sample_in_place: sample.map(|id| named(library, id)),
        result_in_place: result.map(|id| named(library, id)),
    }
}
