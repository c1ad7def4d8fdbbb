//! The types of a module, in Rust.

use super::checks;
use crate::{layout, names};
use rc_cdsl::Component;
use rc_diagnostics::Diagnostics;
use rc_idsl::Library;
use rc_idsl::model::{Member, ModuleId, Primitive, Type, TypeDecl, TypeDeclKind, TypeId};
use rc_syntax::{Literal, LiteralKind};
use serde::Serialize;
use std::collections::BTreeSet;

/// The types of one IDSL module: one file.
#[derive(Debug, Serialize)]
pub struct Module {
    /// The module of Rust.
    pub module: String,
    /// The module of the IDSL.
    pub name: String,
    /// Its documentation.
    pub doc: Vec<String>,
    /// Paths that it uses.
    pub uses: Vec<String>,
    /// Its types, in their order.
    pub types: Vec<TypeView>,
    /// Its constants.
    pub consts: Vec<ConstView>,
    /// The structures of those that travel in place.
    pub in_place: Vec<super::in_place::Structure>,
    /// Whether one of these mentions the module `in_place`.
    pub helpers: bool,
}

/// A constant.
#[derive(Debug, Serialize)]
pub struct ConstView {
    /// Its name.
    pub name: String,
    /// Its documentation.
    pub doc: Vec<String>,
    /// Its type.
    pub ty: String,
    /// Its value.
    pub value: String,
}

/// One type.
#[derive(Debug, Serialize)]
pub struct TypeView {
    /// `enum`, `struct`, `exception` or `alias`.
    pub kind: &'static str,
    /// Its name.
    pub name: String,
    /// Its documentation.
    pub doc: Vec<String>,
    /// What stands in `derive`.
    pub derive: &'static str,
    /// What an alias stands for.
    pub target: String,
    /// The values of an enum.
    pub values: Vec<ValueView>,
    /// The members of a struct or an exception.
    pub members: Vec<MemberView>,
    /// Whether the defaults are not those of the member types.
    pub own_default: bool,
    /// Whether `Self { … }` with its reads fits one line.
    pub short: bool,
    /// Whether anything is checked after reading.
    pub checked: bool,
}

/// One value of an enum.
#[derive(Debug, Serialize)]
pub struct ValueView {
    /// Its name.
    pub name: String,
    /// Its documentation.
    pub doc: Vec<String>,
    /// Its number.
    pub value: i32,
}

/// One member.
#[derive(Debug, Serialize)]
pub struct MemberView {
    /// Its name.
    pub name: String,
    /// Its documentation.
    pub doc: Vec<String>,
    /// Its type.
    pub ty: String,
    /// Its value where nobody gives one.
    pub default: String,
    /// Statements that check it before it is written.
    pub write_checks: Vec<String>,
    /// Statements that check it after it was read.
    pub read_checks: Vec<String>,
}

pub(super) fn of(component: &Component, found: &mut Diagnostics) -> Vec<Module> {
    let library = &component.library;
    let in_place = super::in_place::needed(component);
    let mut modules: Vec<Module> = (0..library.modules.len())
        .map(|at| module(library, ModuleId(at), &in_place, found))
        .collect();
    modules.sort_by(|a, b| a.module.cmp(&b.module));
    modules
}

fn module(
    library: &Library,
    id: ModuleId,
    in_place: &BTreeSet<TypeId>,
    found: &mut Diagnostics,
) -> Module {
    let module = library.module(id);
    let decls = module.types.iter().map(|t| &library.ty(*t).name);
    let mut placed = Vec::new();
    let needed = in_place;
    let mut in_place = Vec::new();
    for ty in module.types.iter().filter(|t| needed.contains(t)) {
        super::collisions(
            super::in_place::methods(library, *ty).into_iter(),
            "members",
            found,
        );
        for structure in super::in_place::of(library, id, *ty) {
            placed.push((&library.ty(*ty).name, structure.name.clone()));
            in_place.push(structure);
        }
    }
    let all = decls.map(|n| (n, names::ty(&n.text))).chain(placed);
    super::collisions(all, "types", found);
    let mut used = Vec::new();
    for ty in &module.types {
        let named = library.named_in(*ty).into_iter();
        used.extend(named.map(|id| library.ty(id).module));
    }
    let mut uses: Vec<String> = used
        .iter()
        .filter(|other| **other != id)
        .map(|other| format!("super::{}", super::type_module(library, *other)))
        .collect();
    uses.sort_by(|a, b| layout::order(a, b));
    uses.dedup();
    Module {
        module: super::type_module(library, id),
        name: module.name.text.clone(),
        doc: module.doc.clone(),
        uses,
        types: module
            .types
            .iter()
            .map(|t| type_view(library, id, *t, found))
            .collect(),
        helpers: in_place.iter().any(super::in_place::Structure::has_helpers),
        in_place,
        consts: module
            .consts
            .iter()
            .map(|c| ConstView {
                name: names::shout(&c.name.text),
                doc: super::doc(&c.doc, None, None),
                ty: match library.resolved(&c.ty) {
                    Type::String(_) => "&str".to_owned(),
                    other => rust(library, other, id),
                },
                value: match &c.value.kind {
                    LiteralKind::String(text) => format!("{text:?}"),
                    _ => value(library, &c.ty, &c.value, id),
                },
            })
            .collect(),
    }
}

fn type_view(library: &Library, home: ModuleId, id: TypeId, found: &mut Diagnostics) -> TypeView {
    let TypeDecl {
        name, doc, kind, ..
    } = library.ty(id);
    let mut view = TypeView {
        kind: "struct",
        name: names::ty(&name.text),
        doc: super::doc(doc, None, None),
        derive: "",
        target: String::new(),
        values: Vec::new(),
        members: Vec::new(),
        own_default: false,
        short: false,
        checked: false,
    };
    match kind {
        TypeDeclKind::Alias(ty) => {
            view.kind = "alias";
            view.target = rust(library, ty, home);
        }
        TypeDeclKind::Enum(values) => {
            view.kind = "enum";
            super::collisions(
                values.iter().map(|v| (&v.name, names::camel(&v.name.text))),
                "enumerators",
                found,
            );
            let one = |v: &rc_idsl::model::Enumerator| ValueView {
                name: names::camel(&v.name.text),
                doc: super::doc(&v.doc, None, None),
                value: v.value,
            };
            view.values = values.iter().map(one).collect();
        }
        TypeDeclKind::Struct(members) | TypeDeclKind::Exception(members) => {
            if matches!(kind, TypeDeclKind::Exception(_)) {
                view.kind = "exception";
            }
            super::collisions(
                members
                    .iter()
                    .map(|m| (&m.name, names::snake(&m.name.text))),
                "members",
                found,
            );
            view.members = members
                .iter()
                .map(|m| member(library, &view.name, home, m))
                .collect();
            view.own_default = members
                .iter()
                .any(|m| m.default.is_some() || long_array(library, &m.ty));
            view.derive = if view.own_default {
                "Clone, Debug, PartialEq"
            } else {
                "Clone, Debug, Default, PartialEq"
            };
            // rustfmt keeps a literal of a structure on one line up to 18 characters.
            view.short = view.members.len() == 1
                && view.members[0].name.len() + ": reader.get()?".len() <= 18;
            view.checked = view.members.iter().any(|m| !m.read_checks.is_empty());
        }
    }
    view
}

fn member(library: &Library, owner: &str, home: ModuleId, member: &Member) -> MemberView {
    let name = names::snake(&member.name.text);
    let what = format!("{owner}.{}", member.name.text);
    let mut ty = rust(library, &member.ty, home);
    if member.optional {
        ty = format!("Option<{ty}>");
    }
    let default = match &member.default {
        Some(literal) if member.optional => {
            format!("Some({})", value(library, &member.ty, literal, home))
        }
        Some(literal) => value(library, &member.ty, literal, home),
        None if long_array(library, &member.ty) && !member.optional => {
            "std::array::from_fn(|_| Default::default())".to_owned()
        }
        None => "Default::default()".to_owned(),
    };
    MemberView {
        doc: super::doc(
            &member.doc,
            member.unit.as_ref(),
            checks::range_text(member).as_ref(),
        ),
        ty,
        default,
        write_checks: checks::lines(
            library,
            member,
            &what,
            &format!("self.{name}"),
            checks::Side::Write,
        ),
        read_checks: checks::lines(
            library,
            member,
            &what,
            &format!("value.{name}"),
            checks::Side::Read,
        ),
        name,
    }
}

/// The standard library has defaults of arrays of at most 32 elements.
fn long_array(library: &Library, ty: &Type) -> bool {
    match library.resolved(ty) {
        Type::Array(element, size) => *size > 32 || long_array(library, element),
        _ => false,
    }
}

/// A type as Rust writes it in the module of `home`.
pub(super) fn rust(library: &Library, ty: &Type, home: ModuleId) -> String {
    rust_with(ty, &|id| {
        let decl = library.ty(id);
        let name = names::ty(&decl.name.text);
        if decl.module == home {
            name
        } else {
            format!("{}::{name}", super::type_module(library, decl.module))
        }
    })
}

/// A type as Rust writes it, with the path of each named type as `named` says.
pub(super) fn rust_with(ty: &Type, named: &dyn Fn(TypeId) -> String) -> String {
    match ty {
        Type::Primitive(primitive) => primitive_word(*primitive).to_owned(),
        Type::String(_) => "String".to_owned(),
        Type::Sequence(element, _) => format!("Vec<{}>", rust_with(element, named)),
        Type::Array(element, size) => format!("[{}; {size}]", rust_with(element, named)),
        Type::Dictionary(key, value) => {
            format!(
                "std::collections::BTreeMap<{}, {}>",
                rust_with(key, named),
                rust_with(value, named)
            )
        }
        Type::Named(id) => named(*id),
    }
}

fn primitive_word(primitive: Primitive) -> &'static str {
    match primitive {
        Primitive::Bool => "bool",
        Primitive::I8 => "i8",
        Primitive::U8 => "u8",
        Primitive::I16 => "i16",
        Primitive::U16 => "u16",
        Primitive::I32 => "i32",
        Primitive::U32 => "u32",
        Primitive::I64 => "i64",
        Primitive::U64 => "u64",
        Primitive::F32 => "f32",
        Primitive::F64 => "f64",
    }
}

/// A value as Rust writes it.
pub(super) fn value(library: &Library, ty: &Type, literal: &Literal, home: ModuleId) -> String {
    let float = matches!(library.resolved(ty), Type::Primitive(p) if p.is_float());
    match &literal.kind {
        LiteralKind::Int(value) if float => format!("{value}.0"),
        LiteralKind::Int(value) => value.to_string(),
        LiteralKind::Float(value) => format!("{value:?}"),
        LiteralKind::Bool(value) => value.to_string(),
        LiteralKind::String(value) => format!("{value:?}.to_owned()"),
        LiteralKind::Name(value) => format!(
            "{}::{}",
            rust(library, library.resolved(ty), home),
            names::camel(value)
        ),
        LiteralKind::Duration(value) => value.to_string(),
    }
}
