//! Types where they are used, neutral of the language that they are printed in.

use rc_idsl::Library;
use rc_idsl::model::{self, TypeDeclKind, TypeId};
use rc_vocabulary::Primitive;
use serde::Serialize;

/// How a type with a name is declared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Declared {
    /// Numbers with names.
    Enum,
    /// Members in order.
    Struct,
    /// A structure that operations throw.
    Exception,
    /// Another name of a type.
    Alias,
}

/// A type where it is used.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
pub enum Type {
    /// A number or a `bool`: `bool`, `int8`, `uint8` … `uint64`, `float32`, `float64`.
    Primitive {
        /// Its type, as the word.
        name: Primitive,
    },
    /// Text in UTF-8.
    Text {
        /// The largest number of bytes.
        bound: Option<u32>,
    },
    /// Any number of elements.
    Sequence {
        /// Their type.
        element: Box<Type>,
        /// The largest number of elements.
        bound: Option<u32>,
    },
    /// A fixed number of elements.
    Array {
        /// Their type.
        element: Box<Type>,
        /// The number of elements.
        length: u32,
    },
    /// Pairs of key and value.
    Dictionary {
        /// The type of keys.
        key: Box<Type>,
        /// The type of values.
        value: Box<Type>,
    },
    /// A type with a name.
    Named {
        /// Module that declares the type.
        module: String,
        /// Name in the IDSL.
        name: String,
        /// How it is declared.
        of: Declared,
        /// The type behind an alias.
        target: Option<Box<Type>>,
    },
}

impl Type {
    /// The type behind aliases.
    pub fn resolved(&self) -> &Self {
        match self {
            Self::Named {
                target: Some(target),
                ..
            } => target.resolved(),
            other => other,
        }
    }

    /// The modules and names of the named types that stand in it.
    pub fn named(&self) -> Vec<(&str, &str)> {
        match self {
            Self::Named { module, name, .. } => vec![(module, name)],
            Self::Sequence { element, .. } | Self::Array { element, .. } => element.named(),
            Self::Dictionary { key, value } => [key.named(), value.named()].concat(),
            Self::Primitive { .. } | Self::Text { .. } => Vec::new(),
        }
    }
}

/// A type where it is used.
pub(super) fn of_type(library: &Library, ty: &model::Type) -> Type {
    let boxed = |ty: &model::Type| Box::new(of_type(library, ty));
    match ty {
        model::Type::Primitive(primitive) => Type::Primitive { name: *primitive },
        model::Type::String(bound) => Type::Text { bound: *bound },
        model::Type::Sequence(element, bound) => Type::Sequence {
            element: boxed(element),
            bound: *bound,
        },
        model::Type::Array(element, length) => Type::Array {
            element: boxed(element),
            length: *length,
        },
        model::Type::Dictionary(key, value) => Type::Dictionary {
            key: boxed(key),
            value: boxed(value),
        },
        model::Type::Named(id) => named(library, *id),
    }
}

pub(super) fn named(library: &Library, id: TypeId) -> Type {
    let decl = library.ty(id);
    let (of, target) = match &decl.kind {
        TypeDeclKind::Enum(_) => (Declared::Enum, None),
        TypeDeclKind::Struct(_) => (Declared::Struct, None),
        TypeDeclKind::Exception(_) => (Declared::Exception, None),
        TypeDeclKind::Alias(target) => (Declared::Alias, Some(Box::new(of_type(library, target)))),
    };
    Type::Named {
        module: library.module(decl.module).name.text.clone(),
        name: decl.name.text.clone(),
        of,
        target,
    }
}
