//! Canonical texts and hashes of operations and interfaces.
//!
//! Two endpoints connect only if the hashes of their types are equal. The canonical text contains
//! names, order, types and bounds. Aliases are replaced by their types. Documentation, units,
//! ranges and defaults do not affect the bytes on the wire, so they are left out. The first
//! occurrence of a named type includes its members; later ones are only its name.

use crate::model::{InterfaceId, Library, Member, Operation, Type, TypeDeclKind, TypeId};
use sha2::{Digest, Sha256};
use std::collections::HashSet;

/// The first eight bytes of the SHA-256 of `text` as a big-endian number.
pub fn hash(text: &str) -> u64 {
    let digest = Sha256::digest(text.as_bytes());
    digest
        .iter()
        .take(8)
        .fold(0, |value, byte| value << 8 | u64::from(*byte))
}

/// The hash of an operation's canonical text: the type hash of a topic.
pub fn operation_hash(library: &Library, interface: InterfaceId, operation: &Operation) -> u64 {
    hash(&operation_text(library, interface, operation))
}

/// The hash of the canonical texts of all operations in order: the type hash of a client or server.
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
    let out = format!(
        "{}/{}(",
        library.interface_path(interface),
        operation.name.text
    );
    let mut text = Text {
        library,
        written: HashSet::new(),
        out,
    };
    text.members(&operation.inputs);
    text.out.push_str(")->(");
    text.members(&operation.outputs);
    if let Some(result) = &operation.result {
        text.out.push_str("return:");
        text.ty(result);
    }
    text.out.push(')');
    for exception in &operation.throws {
        text.out.push('!');
        text.ty(&Type::Named(*exception));
    }
    text.out
}

struct Text<'a> {
    library: &'a Library,
    written: HashSet<TypeId>,
    out: String,
}

impl Text<'_> {
    fn members(&mut self, members: &[Member]) {
        for member in members {
            self.out.push_str(&member.name.text);
            self.out.push_str(if member.optional { "?:" } else { ":" });
            self.ty(&member.ty);
            self.out.push(';');
        }
    }

    fn ty(&mut self, used: &Type) {
        let library = self.library;
        let bound = |bound: &Option<u32>| bound.map_or(String::new(), |n| format!(",{n}"));
        match library.resolved(used) {
            Type::Primitive(primitive) => self.out.push_str(primitive.word()),
            Type::Text { bound: limit } => self.out.push_str(&format!("string<{}>", bound(limit))),
            Type::Sequence {
                element,
                bound: limit,
            } => {
                self.out.push_str("sequence<");
                self.ty(element);
                self.out.push_str(&bound(limit));
                self.out.push('>');
            }
            Type::Array {
                element,
                length: size,
            } => {
                self.ty(element);
                self.out.push_str(&format!("[{size}]"));
            }
            Type::Dictionary { key, value } => {
                self.out.push_str("dictionary<");
                self.ty(key);
                self.out.push(',');
                self.ty(value);
                self.out.push('>');
            }
            Type::Named(id) => {
                self.out.push_str(&library.type_path(*id));
                if self.written.insert(*id) {
                    self.content(*id);
                }
            }
        }
    }

    fn content(&mut self, id: TypeId) {
        self.out.push('{');
        match &self.library.ty(id).kind {
            TypeDeclKind::Enum(values) => {
                for value in values {
                    let text = format!("{}={};", value.name.text, value.value);
                    self.out.push_str(&text);
                }
            }
            TypeDeclKind::Struct(parts) | TypeDeclKind::Exception(parts) => self.members(parts),
            TypeDeclKind::Alias(_) => {}
        }
        self.out.push('}');
    }
}
