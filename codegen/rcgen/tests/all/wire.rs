//! The encoding of types on the wire, derived from the IDSL, in the order of the generated code.

use rc_codegen::ros::names;
use rc_idsl::Library;
use rc_idsl::model::{InterfaceId, Member, Type, TypeDeclKind};
use std::collections::BTreeMap;

/// The encodings of types, topics, requests and responses, by name.
pub(crate) fn of(library: &Library) -> BTreeMap<String, String> {
    let mut all = BTreeMap::new();
    for id in (0..library.interfaces.len()).map(InterfaceId) {
        for operation in &library.interface(id).operations {
            let topic = names::topic_type(library, id, operation).to_string();
            all.insert(topic, members(library, &operation.inputs));
            let service = names::service_type(library, id, operation);
            all.insert(
                format!("{service}_Request"),
                members(library, &operation.inputs),
            );
            let mut parts = Vec::new();
            if !operation.throws.is_empty() {
                parts.push("int32".to_owned());
            }
            for exception in &operation.throws {
                parts.push(text(library, &Type::Named(*exception)));
            }
            parts.extend(operation.outputs.iter().map(|out| member(library, out)));
            parts.extend(operation.result.iter().map(|ty| text(library, ty)));
            all.insert(format!("{service}_Response"), or_one_byte(&parts));
        }
    }
    all
}

fn members(library: &Library, members: &[Member]) -> String {
    let parts: Vec<String> = members.iter().map(|m| member(library, m)).collect();
    or_one_byte(&parts)
}

fn or_one_byte(parts: &[String]) -> String {
    if parts.is_empty() {
        "uint8".to_owned()
    } else {
        parts.join(" ")
    }
}

fn member(library: &Library, member: &Member) -> String {
    let text = text(library, &member.ty);
    if member.optional {
        format!("<=1({text})")
    } else {
        text
    }
}

fn text(library: &Library, ty: &Type) -> String {
    match library.resolved(ty) {
        Type::Primitive(primitive) => primitive.word().to_owned(),
        Type::Text { bound: None } => "string".to_owned(),
        Type::Text { bound: Some(bound) } => format!("string<={bound}"),
        Type::Sequence {
            element,
            bound: None,
        } => format!("*({})", text(library, element)),
        Type::Sequence {
            element,
            bound: Some(bound),
        } => {
            format!("<={bound}({})", text(library, element))
        }
        Type::Array {
            element,
            length: size,
        } => format!("{size}({})", text(library, element)),
        Type::Dictionary { key, value } => {
            format!("*({} {})", text(library, key), text(library, value))
        }
        Type::Named(id) => match &library.ty(*id).kind {
            TypeDeclKind::Enum(_) => "int32".to_owned(),
            TypeDeclKind::Struct(all) | TypeDeclKind::Exception(all) => members(library, all),
            TypeDeclKind::Alias(_) => unreachable!("it is resolved"),
        },
    }
}
