//! The description of an IDSL module, which tools read from running components.

use super::rpc_hash;
use rc_idsl::Library;
use rc_idsl::model::{self, InterfaceId, ModuleId, Type, TypeDeclKind, TypeId};
use rc_syntax::{Literal, LiteralKind};
use rc_values::description::{Interface, Kind, Member, Module, NamedType, Operation};

/// Describes a module.
pub(super) fn of(library: &Library, id: ModuleId) -> Module {
    let module = library.module(id);
    Module {
        module: module.name.text.clone(),
        types: module.types.iter().map(|id| named(library, *id)).collect(),
        interfaces: module
            .interfaces
            .iter()
            .map(|id| interface(library, *id))
            .collect(),
    }
}

fn named(library: &Library, id: TypeId) -> NamedType {
    let decl = library.ty(id);
    NamedType {
        name: decl.name.text.clone(),
        kind: match &decl.kind {
            TypeDeclKind::Struct(all) => Kind::Struct(members(library, all)),
            TypeDeclKind::Exception(all) => Kind::Exception(members(library, all)),
            TypeDeclKind::Enum(values) => {
                let values = values.iter();
                Kind::Enum(values.map(|v| (v.name.text.clone(), v.value)).collect())
            }
            TypeDeclKind::Alias(target) => Kind::Alias(text(library, target)),
        },
    }
}

fn members(library: &Library, members: &[model::Member]) -> Vec<Member> {
    let member = |member: &model::Member| Member {
        name: member.name.text.clone(),
        ty: text(library, &member.ty),
        optional: member.optional,
        unit: member.unit.clone(),
        range: member.range.as_ref().map(|range| {
            let end = |end: &Option<Literal>| rc_values::limit_json(end.as_ref()?.number()?);
            (end(&range.min), end(&range.max))
        }),
        default: member.default.as_ref().map(default),
    };
    members.iter().map(member).collect()
}

fn default(literal: &Literal) -> serde_json::Value {
    match &literal.kind {
        LiteralKind::Int(value) => serde_json::Number::from_i128(*value)
            .map_or(serde_json::Value::Null, serde_json::Value::Number),
        LiteralKind::Float(value) => (*value).into(),
        LiteralKind::Bool(value) => (*value).into(),
        LiteralKind::String(value) | LiteralKind::Name(value) => value.as_str().into(),
        LiteralKind::Duration(value) => (*value).into(),
    }
}

fn interface(library: &Library, id: InterfaceId) -> Interface {
    let interface = library.interface(id);
    let operation = |operation: &model::Operation| Operation {
        name: operation.name.text.clone(),
        id: rpc_hash::of(&operation.name.text),
        hash: format!(
            "{:016x}",
            rc_idsl::canonical::operation_hash(library, id, operation)
        ),
        pattern: match operation.explicit_pattern {
            Some(model::Pattern::Publish) => model::Pattern::Publish,
            Some(model::Pattern::Command | model::Pattern::Query) | None => {
                operation.call_pattern()
            }
        }
        .word()
        .to_owned(),
        inputs: members(library, &operation.inputs),
        outputs: members(library, &operation.outputs),
        result: operation.result.as_ref().map(|ty| text(library, ty)),
        throws: operation
            .throws
            .iter()
            .map(|id| {
                (
                    library.type_path(*id),
                    rpc_hash::of(&library.ty(*id).name.text),
                )
            })
            .collect(),
    };
    Interface {
        name: interface.name.text.clone(),
        operations: interface.operations.iter().map(operation).collect(),
    }
}

/// A type as a description writes it, with aliases resolved.
fn text(library: &Library, ty: &Type) -> String {
    let named = library.unaliased(ty).rename(|id| library.type_path(*id));
    named.to_string()
}
