//! One text and one hash for types that are equal on the wire.
//!
//! Two ends of a connection may talk where the hashes of their operations are equal. The canonical text holds
//! names, order, types and bounds; aliases are replaced by what they stand for; documentation, units, ranges
//! and defaults do not enter it, since they do not change a byte on the wire.

use crate::model::{InterfaceId, Library, Member, Operation, Primitive, Type, TypeDeclKind};
use sha2::{Digest, Sha256};

/// The first eight bytes of the SHA-256 of `text`, as a number.
pub fn hash(text: &str) -> u64 {
    let digest = Sha256::digest(text.as_bytes());
    digest
        .iter()
        .take(8)
        .fold(0, |value, byte| value << 8 | u64::from(*byte))
}

/// The hash of one operation's types, which is the same for every interface that spells it so.
pub fn operation_hash(library: &Library, interface: InterfaceId, operation: &Operation) -> u64 {
    hash(&operation_text(library, interface, operation))
}

/// The hash of all operations of an interface, in their order: the types of a connection for calls.
pub fn interface_hash(library: &Library, interface: InterfaceId) -> u64 {
    let operations = &library.interface(interface).operations;
    let texts: Vec<String> = operations
        .iter()
        .map(|operation| operation_text(library, interface, operation))
        .collect();
    hash(&texts.join("\n"))
}

/// The canonical text of an operation.
pub fn operation_text(library: &Library, interface: InterfaceId, operation: &Operation) -> String {
    let mut out = format!(
        "{}/{}(",
        library.interface_path(interface),
        operation.name.text
    );
    members(library, &operation.inputs, &mut out);
    out.push_str(")->(");
    members(library, &operation.outputs, &mut out);
    if let Some(result) = &operation.result {
        out.push_str("return:");
        ty(library, result, &mut out);
    }
    out.push(')');
    for exception in &operation.throws {
        out.push('!');
        ty(library, &Type::Named(*exception), &mut out);
    }
    out
}

fn members(library: &Library, members: &[Member], out: &mut String) {
    for member in members {
        out.push_str(&member.name.text);
        out.push_str(if member.optional { "?:" } else { ":" });
        ty(library, &member.ty, out);
        out.push(';');
    }
}

fn ty(library: &Library, used: &Type, out: &mut String) {
    let bound = |bound: &Option<u32>| bound.map_or(String::new(), |n| format!(",{n}"));
    match library.resolved(used) {
        Type::Primitive(primitive) => out.push_str(primitive_word(*primitive)),
        Type::Text(limit) => out.push_str(&format!("string<{}>", bound(limit))),
        Type::Sequence(element, limit) => {
            out.push_str("sequence<");
            ty(library, element, out);
            out.push_str(&bound(limit));
            out.push('>');
        }
        Type::Array(element, size) => {
            ty(library, element, out);
            out.push_str(&format!("[{size}]"));
        }
        Type::Dictionary(key, value) => {
            out.push_str("dictionary<");
            ty(library, key, out);
            out.push(',');
            ty(library, value, out);
            out.push('>');
        }
        Type::Named(id) => {
            out.push_str(&library.type_path(*id));
            out.push('{');
            match &library.ty(*id).kind {
                TypeDeclKind::Enum(values) => {
                    values
                        .iter()
                        .for_each(|v| out.push_str(&format!("{}={};", v.name.text, v.value)));
                }
                TypeDeclKind::Struct(parts) | TypeDeclKind::Exception(parts) => {
                    members(library, parts, out);
                }
                TypeDeclKind::Alias(_) => {}
            }
            out.push('}');
        }
    }
}

fn primitive_word(primitive: Primitive) -> &'static str {
    match primitive {
        Primitive::Bool => "bool",
        Primitive::I8 => "int8",
        Primitive::U8 => "uint8",
        Primitive::I16 => "int16",
        Primitive::U16 => "uint16",
        Primitive::I32 => "int32",
        Primitive::U32 => "uint32",
        Primitive::I64 => "int64",
        Primitive::U64 => "uint64",
        Primitive::F32 => "float32",
        Primitive::F64 => "float64",
    }
}
