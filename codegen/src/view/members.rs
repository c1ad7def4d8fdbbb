//! Members of types, parameters of operations, and values.

use super::checks::{self, Check};
use super::types::{Type, of_type};
use rc_idsl::Library;
use rc_idsl::model;
use rc_syntax::{Literal, LiteralKind};
use serde::Serialize;

/// A member of a type, or a parameter of an operation.
#[derive(Debug, Serialize)]
pub struct Member {
    /// The name in the IDSL.
    pub name: String,
    /// Lines of documentation.
    pub doc: Vec<String>,
    /// The type of the value, if there is one.
    #[serde(rename = "type")]
    pub ty: Type,
    /// Whether the value may be missing.
    pub optional: bool,
    /// The unit of the number.
    pub unit: Option<String>,
    /// The data prototype of its type, if the interface names one here.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub meaning: Option<String>,
    /// The allowed values, as documents print them: "0 to 100".
    pub range: Option<String>,
    /// The default value.
    pub default: Option<Value>,
    /// Checks of writers and readers.
    pub checks: Vec<Check>,
}

/// The value of a constant, or a default.
#[derive(Debug, Serialize)]
pub struct Value {
    /// The type with aliases resolved.
    #[serde(rename = "type")]
    pub ty: Type,
    /// A number or a `bool` in decimal notation, a text without quotes, or the name of an
    /// enumerator.
    pub text: String,
}

/// A member or a parameter.
pub(super) fn member(library: &Library, member: &model::Member) -> Member {
    Member {
        name: member.name.text.clone(),
        doc: member.doc.clone(),
        ty: of_type(library, &member.ty),
        optional: member.optional,
        unit: member.unit.clone(),
        meaning: member.prototype.as_ref().map(|name| name.text.clone()),
        range: checks::range_text(member),
        default: member
            .default
            .as_ref()
            .map(|literal| value(library, &member.ty, literal)),
        checks: checks::of(library, member),
    }
}

pub(super) fn value(library: &Library, ty: &model::Type, literal: &Literal) -> Value {
    let ty = library.resolved(ty);
    let float = matches!(ty, model::Type::Primitive(p) if p.is_float());
    Value {
        ty: of_type(library, ty),
        text: match &literal.kind {
            LiteralKind::Int(value) if float => format!("{value}.0"),
            LiteralKind::Int(value) => value.to_string(),
            LiteralKind::Float(value) => format!("{value:?}"),
            LiteralKind::Bool(value) => value.to_string(),
            LiteralKind::String(value) | LiteralKind::Name(value) => value.clone(),
            LiteralKind::Duration(value) => value.to_string(),
        },
    }
}
