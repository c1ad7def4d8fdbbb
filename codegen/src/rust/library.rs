//! Names and types of Rust for IDSL modules: what `templates/rust/module.rs.tera` prints.

use super::in_place::{self, InPlaceType};
use super::interface::{self, Interface};
use super::members::{Member, is_long_array, member};
use super::names;
use super::types;
use crate::view::library as view;
use crate::view::members;
use crate::view::types::{Type, resolved};
use serde::Serialize;

/// One IDSL module: one file.
#[derive(Debug, Serialize)]
pub(crate) struct Module<'a> {
    pub(crate) name: &'a str,
    pub(crate) stem: String,
    doc: &'a [String],
    constants: Vec<Constant<'a>>,
    types: Vec<TypeDecl<'a>>,
    interfaces: Vec<Interface<'a>>,
    /// The description as a literal of Rust.
    description: String,
}

#[derive(Debug, Serialize)]
struct Constant<'a> {
    name: String,
    doc: &'a [String],
    ty: String,
    value: String,
}

#[derive(Debug, Serialize)]
struct TypeDecl<'a> {
    kind: &'static str,
    name: String,
    doc: &'a [String],
    values: Vec<Enumerator<'a>>,
    members: Vec<Member>,
    /// The target of an alias.
    target: String,
    /// Whether a default differs from the one that Rust derives.
    own_default: bool,
    /// The derived traits of a structure.
    derives: &'static str,
    /// Whether its members follow each other without checks.
    plain: bool,
    in_place: Vec<InPlaceType>,
}

#[derive(Debug, Serialize)]
struct Enumerator<'a> {
    name: String,
    doc: &'a [String],
    /// The attribute of the default.
    attribute: &'static str,
    number: i32,
}

pub(crate) fn module(module: &view::Module) -> Module<'_> {
    let types: Vec<TypeDecl> = module
        .types
        .iter()
        .map(|decl| type_decl(&module.name, decl))
        .collect();
    let path = types::in_module(&module.name);
    let constants = module.constants.iter().map(|constant| Constant {
        name: names::shout(&constant.name),
        doc: &constant.doc,
        ty: match resolved(&constant.ty) {
            Type::Text { .. } => "&str".to_owned(),
            ty @ (Type::Primitive(_)
            | Type::Sequence { .. }
            | Type::Array { .. }
            | Type::Dictionary { .. }
            | Type::Named(_)) => types::owned(ty, &path),
        },
        value: match resolved(&constant.ty) {
            Type::Text { .. } => format!("{:?}", constant.value.text),
            Type::Primitive(_)
            | Type::Sequence { .. }
            | Type::Array { .. }
            | Type::Dictionary { .. }
            | Type::Named(_) => types::value(&constant.value, &path),
        },
    });
    Module {
        name: &module.name,
        stem: names::module(&module.name),
        doc: &module.doc,
        constants: constants.collect(),

        types,
        interfaces: module.interfaces.iter().map(interface::of).collect(),
        description: raw(&module.description),
    }
}

/// A text as a raw string of Rust.
fn raw(text: &str) -> String {
    let mut marks = "#".to_owned();
    while text.contains(&format!("\"{marks}")) {
        marks.push('#');
    }
    format!("r{marks}\"{text}\"{marks}")
}

fn type_decl<'a>(home: &str, decl: &'a view::TypeDecl) -> TypeDecl<'a> {
    let path = types::in_module(home);
    let mut out = TypeDecl {
        kind: "",
        name: names::ty(&decl.name),
        doc: &decl.doc,
        values: Vec::new(),
        members: Vec::new(),
        target: String::new(),
        own_default: false,
        derives: "",
        plain: false,
        in_place: in_place::of(home, &decl.in_place),
    };
    match &decl.kind {
        view::Kind::Enum { values } => {
            out.kind = "enum";
            let one = |(at, value): (usize, &'a view::Enumerator)| Enumerator {
                name: names::camel(&value.name),
                doc: &value.doc,
                attribute: if at == 0 { "#[default]" } else { "" },
                number: value.number,
            };
            out.values = values.iter().enumerate().map(one).collect();
        }
        view::Kind::Alias { target } => {
            out.kind = "alias";
            out.target = types::owned(target, &path);
        }
        view::Kind::Struct { members } | view::Kind::Exception { members } => {
            let exception = matches!(decl.kind, view::Kind::Exception { .. });
            out.kind = if exception { "exception" } else { "struct" };
            out.own_default = members
                .iter()
                .any(|m| m.default.is_some() || is_long_array(&m.ty));
            out.derives = if out.own_default {
                "Clone, Debug, PartialEq"
            } else {
                "Clone, Debug, Default, PartialEq"
            };
            out.plain = !members.is_empty() && members.iter().all(|m| m.checks.is_empty());
            let one = |m: &members::Member| member(m, &out.name, names::snake(&m.name), &path);
            out.members = members.iter().map(one).collect();
        }
    }
    out
}
