//! Types where they are used, neutral of the language that they are printed in.

use rc_idsl::Library;
use rc_idsl::model::{self, TypeDeclKind, TypeId};
use serde::Serialize;

/// The declaration of a type with a name.
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
pub type Type = rc_vocabulary::Type<Named>;

/// A type with a name.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Named {
    /// Module that declares the type.
    pub module: String,
    /// Name in the IDSL.
    pub name: String,
    /// Its declaration.
    pub of: Declared,
    /// The target of an alias.
    pub target: Option<Box<Type>>,
}

/// The type with aliases resolved.
pub fn resolved(ty: &Type) -> &Type {
    match ty {
        Type::Named(Named {
            target: Some(target),
            ..
        }) => resolved(target),
        Type::Named(_)
        | Type::Primitive(_)
        | Type::Text { .. }
        | Type::Sequence { .. }
        | Type::Array { .. }
        | Type::Dictionary { .. } => ty,
    }
}

/// A type where it is used.
pub(super) fn of_type(library: &Library, ty: &model::Type) -> Type {
    ty.rename(|id| of_name(library, *id))
}

pub(super) fn named(library: &Library, id: TypeId) -> Type {
    Type::Named(of_name(library, id))
}

fn of_name(library: &Library, id: TypeId) -> Named {
    let decl = library.ty(id);
    let (of, target) = match &decl.kind {
        TypeDeclKind::Enum(_) => (Declared::Enum, None),
        TypeDeclKind::Struct(_) => (Declared::Struct, None),
        TypeDeclKind::Exception(_) => (Declared::Exception, None),
        TypeDeclKind::Alias(target) => (Declared::Alias, Some(Box::new(of_type(library, target)))),
    };
    Named {
        module: library.module(decl.module).name.text.clone(),
        name: decl.name.text.clone(),
        of,
        target,
    }
}
