//! The structures of types that travel in place, see `rc_middleware::in_place`. Every gap of the layout is a member
//! of its own, so that no byte of one is without meaning.

mod maker;

use super::interfaces::bare;
use crate::{layout, names};
use maker::{Maker, Part, literal};
use rc_cdsl::Component;
use rc_cdsl::model::Role;
use rc_idsl::Library;
use rc_idsl::model::{Member, ModuleId, Type, TypeDeclKind, TypeId};
use rc_syntax::Name;
use serde::Serialize;
use std::collections::{BTreeSet, HashMap};

/// One structure.
#[derive(Debug, Serialize)]
pub struct Structure {
    /// Its name.
    pub name: String,
    /// The type that owns its values.
    pub value: String,
    /// Its documentation.
    pub doc: Vec<String>,
    /// Its fields, in their order.
    pub fields: Vec<Field>,
    /// Its methods: documentation, signature and body.
    pub methods: Vec<Method>,
    /// The body of `reset`.
    pub reset: Vec<String>,
    /// The body of `set`.
    pub set: Vec<String>,
    /// The expression of its value.
    pub owned: Vec<String>,
    /// The body of `check`, where there is something to be checked.
    pub check: Vec<String>,
    /// Whether it is a number that stands for a value of the enum `value`.
    pub number: bool,
}

/// One field.
#[derive(Debug, Serialize)]
pub struct Field {
    /// Its documentation.
    pub doc: Vec<String>,
    /// `pub name: Type`
    pub text: String,
}

/// One method.
#[derive(Debug, Serialize)]
pub struct Method {
    /// Its documentation.
    pub doc: Vec<String>,
    /// `pub fn …(&self) -> … {`
    pub signature: String,
    /// Its statements.
    pub body: Vec<String>,
}

/// The name of the structure of a type.
pub(super) fn name(library: &Library, id: TypeId) -> String {
    format!("{}InPlace", names::ty(&library.ty(id).name.text))
}

/// The same, with its module.
pub(super) fn path(library: &Library, id: TypeId) -> String {
    let module = super::type_module(library, library.ty(id).module);
    format!("{module}::{}", name(library, id))
}

/// The types that a component needs in place, with all that is in them.
pub(super) fn needed(component: &Component) -> BTreeSet<TypeId> {
    let library = &component.library;
    let mut needed = BTreeSet::new();
    for slot in &component.slots {
        for operation in &library.interface(slot.interface).operations {
            let root = match slot.role {
                Role::Publishes | Role::SubscribesTo => operation.topic_in_place(library),
                Role::Requires | Role::Implements if super::two_way(slot.role, operation) => {
                    operation.result_in_place(library)
                }
                Role::Requires | Role::Implements => None,
            };
            root.into_iter()
                .for_each(|id| reach(library, id, &mut needed));
        }
    }
    needed
}

fn reach(library: &Library, id: TypeId, out: &mut BTreeSet<TypeId>) {
    let mut next = vec![id];
    while let Some(id) = next.pop() {
        if matches!(library.ty(id).kind, TypeDeclKind::Alias(_)) || out.insert(id) {
            next.extend(library.named_in(id));
        }
    }
}

/// The methods that the structure of a type gets, each with the member that it is of.
pub(super) fn methods(library: &Library, id: TypeId) -> Vec<(&Name, String)> {
    let TypeDeclKind::Struct(members) = &library.ty(id).kind else {
        return Vec::new();
    };
    let of = |member: &Member| {
        let name = names::snake(&member.name.text);
        let short = bare(&name).to_owned();
        match library.resolved(&member.ty) {
            ty if member.optional || matches!(ty, Type::Sequence(..)) => {
                vec![name, format!("{short}_mut"), format!("resize_{short}")]
            }
            Type::String(_) => vec![name, format!("set_{short}")],
            _ => Vec::new(),
        }
    };
    let all = members
        .iter()
        .flat_map(|m| of(m).into_iter().map(|method| (&m.name, method)));
    all.collect()
}

/// The structures of one type: first those of what is nested in it without a name.
pub(super) fn of(library: &Library, home: ModuleId, id: TypeId) -> Vec<Structure> {
    let decl = library.ty(id);
    let own = names::ty(&decl.name.text);
    match &decl.kind {
        TypeDeclKind::Struct(members) => {
            let parts: Vec<Part> = members
                .iter()
                .map(|member| {
                    let name = names::snake(&member.name.text);
                    Part {
                        ty: library.resolved(&member.ty).clone(),
                        optional: member.optional,
                        what: format!("{own}.{}", member.name.text),
                        source: format!("value.{name}"),
                        member: Some(member),
                        name,
                    }
                })
                .collect();
            let mut maker = Maker {
                library,
                home,
                done: Vec::new(),
                known: HashMap::new(),
            };
            let (mut structure, values) = maker.structure(&own, &own, &parts);
            structure.owned = literal(&own, &parts, &values);
            maker.done.push(structure);
            maker.done
        }
        TypeDeclKind::Enum(_) => {
            let doc = format!("`{own}` in place: a number, until somebody asks.");
            let mut structure = Structure::new(&own, &own, &doc);
            structure.number = true;
            vec![structure]
        }
        TypeDeclKind::Exception(_) | TypeDeclKind::Alias(_) => Vec::new(),
    }
}

impl Structure {
    fn new(own: &str, value: &str, doc: &str) -> Self {
        Self {
            name: format!("{own}InPlace"),
            value: value.to_owned(),
            doc: layout::doc(&[doc.to_owned()]),
            fields: Vec::new(),
            methods: Vec::new(),
            reset: Vec::new(),
            set: Vec::new(),
            owned: Vec::new(),
            check: Vec::new(),
            number: false,
        }
    }

    /// Whether it mentions the module `in_place`; what has a length does, and what has a `bool`.
    pub(super) fn has_helpers(&self) -> bool {
        !self.methods.is_empty() || self.fields.iter().any(|f| f.text.contains("in_place::"))
    }

    fn field(&mut self, doc: &[String], text: String) {
        let doc = doc.to_vec();
        self.fields.push(Field { doc, text });
    }

    fn method(&mut self, doc: &str, head: &str, args: &[&str], returns: &str, body: Vec<String>) {
        let args: Vec<String> = args.iter().map(|arg| (*arg).to_owned()).collect();
        self.methods.push(Method {
            doc: layout::doc(&[doc.to_owned()]),
            signature: layout::signature(
                4,
                &format!("pub fn {head}"),
                &args,
                &format!(" -> {returns} {{"),
            ),
            body,
        });
    }
}
