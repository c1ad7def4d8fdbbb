//! Names and types of Python for the types of IDSL modules: what `templates/python/module.py.tera`
//! prints.

use super::imports::Imports;
use super::{documentation, layout, names, types};
use crate::view;
use crate::view::library::{Kind, Module, TypeDecl};
use crate::view::members::Member;
use crate::view::types::{Declared, Named, Type, resolved};
use rc_vocabulary::Role;
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};

/// One IDSL module: one file below `types`.
#[derive(Debug, Serialize)]
pub(crate) struct TypeModule {
    /// The name of the file without its ending.
    pub(crate) stem: String,
    doc: String,
    constants: Vec<Constant>,
    enums: Vec<Enum>,
    classes: Vec<Class>,
    aliases: Vec<Alias>,
    /// Annotation of values in shared memory.
    views: Vec<View>,
    imports: Imports,
    /// The names that it declares.
    pub(crate) exports: Vec<String>,
}

impl TypeModule {
    /// Whether a text mentions an alias of this module.
    pub(crate) fn has_alias_in(&self, text: &str) -> bool {
        let mut words = text.split(|c: char| !(c.is_alphanumeric() || c == '_'));
        words.any(|word| self.aliases.iter().any(|alias| alias.name == word))
    }
}

#[derive(Debug, Serialize)]
struct Constant {
    name: String,
    ty: String,
    value: String,
    doc: String,
}

#[derive(Debug, Serialize)]
struct Enum {
    name: String,
    doc: String,
    values: Vec<Enumerator>,
}

#[derive(Debug, Serialize)]
struct Enumerator {
    name: String,
    number: i32,
    doc: String,
}

#[derive(Debug, Serialize)]
struct Class {
    name: String,
    /// The class of the package that it stands on, and arguments of `dataclass`.
    base: &'static str,
    options: &'static str,
    doc: String,
    fields: Vec<Field>,
}

#[derive(Debug, Serialize)]
struct Field {
    /// The whole line, without its indentation.
    line: String,
    doc: String,
}

#[derive(Debug, Serialize)]
struct Alias {
    name: String,
    target: String,
    doc: String,
}

/// A structure in shared memory.
#[derive(Debug, Serialize)]
struct View {
    name: String,
    idsl: String,
    /// The class that lends a sample; empty where none does.
    loan: String,
    fields: Vec<String>,
}

/// The types of a component.
pub(crate) struct Types<'a> {
    view: &'a view::Component,
    /// The first enumerators, by module and enum.
    first: BTreeMap<(&'a str, &'a str), String>,
    /// Structures that views and loans are needed of.
    viewed: BTreeSet<(String, String)>,
    lent: BTreeSet<(String, String)>,
}

impl<'a> Types<'a> {
    pub(crate) fn of(view: &'a view::Component) -> Self {
        let mut types = Self {
            view,
            first: BTreeMap::new(),
            viewed: BTreeSet::new(),
            lent: BTreeSet::new(),
        };
        for module in &view.modules {
            for decl in &module.types {
                if let Kind::Enum { values } = &decl.kind {
                    let first = values.first().map_or("", |first| &first.name);
                    let key = (module.name.as_str(), decl.name.as_str());
                    types.first.insert(key, names::shout(first));
                }
            }
        }
        for slot in &view.slots {
            let operations = view.interface(slot).into_iter().flat_map(|i| &i.operations);
            for operation in operations {
                let sample = operation.sample_in_place.as_ref();
                match slot.role {
                    Role::Publishes => sample.into_iter().for_each(|ty| types.lend(ty)),
                    Role::SubscribesTo if slot.in_place => {
                        sample.into_iter().for_each(|ty| types.see(ty));
                    }
                    Role::Requires => {
                        let result = operation.result_in_place.iter();
                        result.for_each(|ty| types.see(ty));
                    }
                    Role::SubscribesTo | Role::Implements => {}
                }
            }
        }
        types
    }

    fn decl(&self, module: &str, name: &str) -> Option<&'a TypeDecl> {
        let module = self.view.modules.iter().find(|m| m.name == module)?;
        module.types.iter().find(|decl| decl.name == name)
    }

    fn lend(&mut self, ty: &Type) {
        if let Type::Named(Named { module, name, .. }) = ty {
            self.lent.insert((module.clone(), name.clone()));
        }
        self.see(ty);
    }

    /// Adds the views of a type and of all structures in it.
    fn see(&mut self, ty: &Type) {
        match resolved(ty) {
            Type::Sequence { element, .. } | Type::Array { element, .. } => self.see(element),
            Type::Named(Named {
                module,
                name,
                of: Declared::Struct,
                ..
            }) if self.viewed.insert((module.clone(), name.clone())) => {
                let decl = self.decl(module, name);
                if let Some(Kind::Struct { members }) = decl.map(|decl| &decl.kind) {
                    members.iter().for_each(|member| self.see(&member.ty));
                }
            }
            Type::Primitive(_) | Type::Text { .. } | Type::Dictionary { .. } | Type::Named(_) => {}
        }
    }

    fn first(&self, module: &str, name: &str) -> String {
        self.first.get(&(module, name)).cloned().unwrap_or_default()
    }

    /// The default value of a member, as an expression.
    pub(crate) fn default_of(&self, member: &Member, path: types::Path) -> String {
        expression(types::default(member, path, &|module, name| {
            self.first(module, name)
        }))
    }

    /// The default value of a type, as an expression.
    pub(crate) fn default_of_type(&self, ty: &Type, path: types::Path) -> String {
        expression(types::of_type(ty, path, &|module, name| {
            self.first(module, name)
        }))
    }

    /// The name of a type in the file of another module, or of this one.
    pub(crate) fn path_in(home: &str) -> impl Fn(&str, &str) -> String {
        move |module, name| {
            let name = names::class(name);
            if module == home {
                name
            } else {
                format!("_{}.{name}", names::module(module))
            }
        }
    }

    /// The file of a module.
    pub(crate) fn module(&self, module: &Module) -> TypeModule {
        let path = Self::path_in(&module.name);
        let constants = module.constants.iter().map(|constant| Constant {
            name: names::shout(&constant.name),
            ty: types::annotation(&constant.ty, &path),
            value: types::value(&constant.value, &path),
            doc: documentation::docstring(0, &constant.doc),
        });
        let constants: Vec<Constant> = constants.collect();
        let (mut enums, mut classes, mut aliases) = (Vec::new(), Vec::new(), Vec::new());
        for decl in &module.types {
            let (name, idsl) = (names::class(&decl.name), decl.name.clone());
            let doc = |what: &str| {
                let otherwise = format!("The {what} `{idsl}`.");
                documentation::docstring_or(4, &decl.doc, otherwise)
            };
            match &decl.kind {
                Kind::Enum { values } => enums.push(Enum {
                    doc: doc("enumeration"),
                    name,
                    values: values
                        .iter()
                        .map(|value| Enumerator {
                            name: names::shout(&value.name),
                            number: value.number,
                            doc: documentation::docstring(4, &value.doc),
                        })
                        .collect(),
                }),
                Kind::Struct { members } => classes.push(Class {
                    doc: doc("structure"),
                    name,
                    base: "Struct",
                    options: "slots=True, eq=False",
                    fields: members
                        .iter()
                        .map(|m| self.field(m, &path, false))
                        .collect(),
                }),
                Kind::Exception { members } => classes.push(Class {
                    doc: doc("exception"),
                    name,
                    base: "RemoteError",
                    options: "eq=False",
                    fields: members.iter().map(|m| self.field(m, &path, true)).collect(),
                }),
                Kind::Alias { target } => aliases.push(Alias {
                    name,
                    target: types::annotation(target, &path),
                    doc: documentation::docstring(0, &decl.doc),
                }),
            }
        }
        let views = self.views(module);
        let fields = classes.iter().flat_map(|class| &class.fields);
        let mut texts: Vec<&str> = fields.map(|field| field.line.as_str()).collect();
        texts.extend(aliases.iter().map(|alias| alias.target.as_str()));
        texts.extend(
            views
                .iter()
                .flat_map(|view| &view.fields)
                .map(String::as_str),
        );
        let others = self.view.modules.iter().filter(|m| m.name != module.name);
        let others = others.map(|other| names::module(&other.name));
        let mentioned = |stem: &String| layout::mentions(&texts, &format!("_{stem}."));
        let mut others: Vec<String> = others.filter(mentioned).collect();
        others.sort();
        let others = others.into_iter();
        let others = others.map(|stem| format!("from . import {stem} as _{stem}"));
        let has_typing = !aliases.is_empty() || !constants.is_empty() || !views.is_empty();
        let words = [
            ("_dataclasses.", !classes.is_empty()),
            ("_enum.", !enums.is_empty()),
            ("_typing.", has_typing),
            ("_robocomp.", !classes.is_empty() || !views.is_empty()),
        ];
        let imports = Imports::of(&texts, &words, others.collect());
        let mut exports: Vec<String> = constants.iter().map(|c| c.name.clone()).collect();
        exports.extend(enums.iter().map(|e| e.name.clone()));
        exports.extend(classes.iter().map(|c| c.name.clone()));
        exports.extend(aliases.iter().map(|a| a.name.clone()));
        exports.extend(views.iter().flat_map(|view| {
            let loan = Some(view.loan.clone()).filter(|loan| !loan.is_empty());
            std::iter::once(view.name.clone()).chain(loan)
        }));
        TypeModule {
            stem: names::module(&module.name),
            doc: documentation::docstring_or(
                0,
                &module.doc,
                format!("The types of the module `{}`.", module.name),
            ),
            constants,
            enums,
            classes,
            aliases,
            views,
            imports,
            exports,
        }
    }

    fn field(&self, member: &Member, path: types::Path, exception: bool) -> Field {
        let name = if exception {
            names::exception_member(&member.name)
        } else {
            names::member(&member.name)
        };
        let ty = types::member(member, path);
        let default = types::default(member, path, &|module, name| self.first(module, name));
        let line = match default {
            types::Default::Value(value) => format!("{name}: {ty} = {value}"),
            types::Default::New(new) => {
                let factory = match new.as_str() {
                    "[]" | "{}" => factory(&ty),
                    _ => format!("lambda: {new}"),
                };
                let arguments = [format!("default_factory={factory}")];
                layout::call(
                    4,
                    &format!("{name}: {ty} = _dataclasses.field"),
                    &arguments,
                    "",
                )
            }
        };
        Field {
            line,
            doc: documentation::of_member(member),
        }
    }

    /// The classes that annotate the structures of a module in shared memory.
    fn views(&self, module: &Module) -> Vec<View> {
        let mut views = Vec::new();
        for decl in &module.types {
            let key = (module.name.clone(), decl.name.clone());
            let Kind::Struct { members } = &decl.kind else {
                continue;
            };
            if !self.viewed.contains(&key) {
                continue;
            }
            let path = |home: &str, name: &str| {
                let is_struct = self
                    .decl(home, name)
                    .is_some_and(|decl| matches!(decl.kind, Kind::Struct { .. }));
                let class = Self::path_in(&module.name)(home, name);
                if is_struct {
                    class + &ending(self.view, home, name, "View")
                } else {
                    class
                }
            };
            let fields = members.iter().map(|member| {
                let ty = match resolved(&member.ty) {
                    Type::Sequence { element, .. } | Type::Array { element, .. }
                        if types::dtype(element).is_none() =>
                    {
                        format!("_typing.Sequence[{}]", types::annotation(element, &path))
                    }
                    Type::Primitive(_)
                    | Type::Text { .. }
                    | Type::Sequence { .. }
                    | Type::Array { .. }
                    | Type::Dictionary { .. }
                    | Type::Named(_) => types::annotation(&member.ty, &path),
                };
                let optional = if member.optional { " | None" } else { "" };
                format!("{}: {ty}{optional}", names::member(&member.name))
            });
            let class = names::class(&decl.name);
            let lent = self.lent.contains(&key);
            views.push(View {
                loan: if lent {
                    class.clone() + &ending(self.view, &module.name, &decl.name, "Loan")
                } else {
                    String::new()
                },
                name: class + &ending(self.view, &module.name, &decl.name, "View"),
                idsl: decl.name.clone(),
                fields: fields.collect(),
            });
        }
        views
    }
}

/// The type that annotates a structure in place: `View`, or `Loan` of a sample to publish.
pub(super) fn in_place(view: &view::Component, ty: &Type, path: types::Path, word: &str) -> String {
    let ending = match resolved(ty) {
        Type::Named(Named { module, name, .. }) => ending(view, module, name, word),
        Type::Primitive(_)
        | Type::Text { .. }
        | Type::Sequence { .. }
        | Type::Array { .. }
        | Type::Dictionary { .. } => word.to_owned(),
    };
    types::annotation(ty, path) + &ending
}

/// The suffix that makes the name of such a class from that of a structure. It avoids a type of the
/// module with this name.
fn ending(view: &view::Component, module: &str, name: &str, word: &str) -> String {
    let wanted = names::class(name) + word;
    let mut types = view
        .modules
        .iter()
        .filter(|m| m.name == module)
        .flat_map(|m| &m.types);
    let is_taken = types.any(|decl| names::class(&decl.name) == wanted);
    format!("{word}{}", if is_taken { "_" } else { "" })
}

fn expression(default: types::Default) -> String {
    match default {
        types::Default::Value(text) | types::Default::New(text) => text,
    }
}

/// `list[Point]` as an expression: the type of its elements may be declared further down.
fn factory(ty: &str) -> String {
    let Some((head, inner)) = ty.strip_suffix(']').and_then(|ty| ty.split_once('[')) else {
        return ty.to_owned();
    };
    let parts: Vec<String> = match head {
        // A key is a primitive type, a text or an enum, and has no comma in its name.
        "dict" => inner.splitn(2, ", ").map(types::text).collect(),
        _ => vec![types::text(inner)],
    };
    format!("{head}[{}]", parts.join(", "))
}
