//! The types of a module in OMG IDL 4.2.

use super::literal::{plain, quoted};
use super::names::{Names, sequence};
use super::rpc_names::exception_hash;
use super::scope::{Scope, escaped};
use rc_idsl::Library;
use rc_idsl::model::{Const, Enumerator, Member, ModuleId, Type, TypeDeclKind, TypeId};
use rc_syntax::{Literal, LiteralKind, Name};
use std::collections::{HashMap, HashSet};

/// The text of a file, with indentation.
#[derive(Default)]
pub(super) struct Text {
    pub(super) out: String,
    depth: usize,
}

impl Text {
    pub(super) fn line(&mut self, line: &str) {
        if !line.is_empty() {
            self.out.push_str(&"    ".repeat(self.depth));
        }
        self.out.push_str(line);
        self.out.push('\n');
    }

    /// An empty line between two declarations.
    pub(super) fn gap(&mut self) {
        if !self.out.ends_with("{\n") {
            self.line("");
        }
    }

    pub(super) fn doc(&mut self, lines: &[String]) {
        for line in lines {
            let line = format!("/// {line}");
            let line = line.trim_end();
            // A `\` at the end would make the next line a part of this one.
            let end = if line.ends_with('\\') { " //" } else { "" };
            self.line(&format!("{line}{end}"));
        }
    }

    /// Opens a declaration with a body.
    pub(super) fn open(&mut self, head: &str) {
        self.line(head);
        self.line("{");
        self.depth += 1;
    }

    pub(super) fn close(&mut self) {
        self.depth -= 1;
        self.line("};");
    }
}

/// Writes the declarations of one module.
pub(super) struct Writer<'a> {
    pub(super) library: &'a Library,
    pub(super) names: &'a Names,
    pub(super) text: Text,
    /// The names of the module.
    pub(super) scope: Scope,
}

impl Writer<'_> {
    pub(super) fn constant(&mut self, name: &str, one: &Const) {
        let ty = self.names.ty(self.library, &one.ty).0;
        let Some(value) = value(self.library.resolved(&one.ty), &one.value) else {
            return;
        };
        self.text.gap();
        self.text.doc(&one.doc);
        self.text
            .line(&format!("const {ty} {} = {value};", escaped(name)));
    }

    /// Writes a type after the types it depends on: OMG IDL has no forward references.
    pub(super) fn declare(&mut self, id: TypeId, home: ModuleId, done: &mut HashSet<TypeId>) {
        if self.library.ty(id).module != home || !done.insert(id) {
            return;
        }
        for inner in self.library.named_in(id) {
            self.declare(inner, home, done);
        }
        let decl = self.library.ty(id);
        let name = self.names.types[&id].clone();
        match &decl.kind {
            TypeDeclKind::Enum(values) => self.enumeration(id, &name, &decl.doc, values),
            TypeDeclKind::Struct(members) => self.structure(&name, &decl.doc, members),
            TypeDeclKind::Exception(members) => {
                let mut doc = decl.doc.clone();
                doc.push("An exception.".to_owned());
                self.structure(&name, &doc, members);
                let hash = crate::view::rpc_hash::of(&decl.name.text);
                let constant = exception_hash(&name);
                self.text.gap();
                self.text
                    .line(&format!("const int32 {} = {hash};", escaped(&constant)));
            }
            TypeDeclKind::Alias(Type::Dictionary { key, value }) => {
                let member = |name: &str, ty: &Type| {
                    Member::plain(Name::new(name, decl.name.span), ty.clone())
                };
                let entry = self.names.entries[&id].clone();
                let doc = [format!("One entry of `{name}`.")];
                self.structure(&entry, &doc, &[member("key", key), member("value", value)]);
                self.text.gap();
                let mut doc = decl.doc.clone();
                doc.push("A dictionary: no key twice.".to_owned());
                self.text.doc(&doc);
                let module = &self.library.module(home).name.text;
                let entries =
                    sequence(&format!("::{}::{}", escaped(module), escaped(&entry)), None);
                self.text
                    .line(&format!("typedef {entries} {};", escaped(&name)));
            }
            TypeDeclKind::Alias(ty) => {
                let (ty, sizes) = self.names.ty(self.library, ty);
                self.text.gap();
                self.text.doc(&decl.doc);
                self.text
                    .line(&format!("typedef {ty} {}{sizes};", escaped(&name)));
            }
        }
    }

    /// Writes an enum, an int32 on the wire. With a negative value, which some compilers refuse, it
    /// becomes an int32 with constants.
    fn enumeration(&mut self, id: TypeId, name: &str, doc: &[String], values: &[Enumerator]) {
        let names = self.names.enumerators[&id].clone();
        self.text.gap();
        self.text.doc(doc);
        if values.iter().any(|v| v.value < 0) {
            self.text.line("/// An enum of these constants.");
            self.text.line(&format!("typedef int32 {};", escaped(name)));
            for (name, value) in names.iter().zip(values) {
                self.text.doc(&value.doc);
                self.text
                    .line(&format!("const int32 {} = {};", escaped(name), value.value));
            }
            return;
        }
        self.text.open(&format!("enum {}", escaped(name)));
        let mut next = 0;
        for (at, (name, value)) in names.iter().zip(values).enumerate() {
            self.text.doc(&value.doc);
            let number = if value.value == next {
                String::new()
            } else {
                format!("@value({}) ", value.value)
            };
            next = value.value.wrapping_add(1);
            let comma = if at + 1 < names.len() { "," } else { "" };
            self.text.line(&format!("{number}{}{comma}", escaped(name)));
        }
        self.text.close();
    }

    fn structure(&mut self, name: &str, doc: &[String], members: &[Member]) {
        self.structure_or(name, doc, members, "octet");
    }

    /// Writes a struct. Without members it has one member of the type `nothing`, an octet on the
    /// wire.
    pub(super) fn structure_or(
        &mut self,
        name: &str,
        doc: &[String],
        members: &[Member],
        nothing: &str,
    ) {
        // An optional array becomes a sequence, whose element type needs a name.
        let mut elements = HashMap::new();
        for member in members.iter().filter(|m| m.optional) {
            if let (ty, sizes) = self.names.ty(self.library, &member.ty)
                && !sizes.is_empty()
            {
                let element = self
                    .scope
                    .unique_name(&format!("{name}_{}", member.name.text));
                self.text.gap();
                self.text
                    .line(&format!("typedef {ty} {}{sizes};", escaped(&element)));
                elements.insert(&member.name.text, element);
            }
        }
        self.text.gap();
        self.text.doc(doc);
        self.text.line("@final");
        self.text.open(&format!("struct {}", escaped(name)));
        let mut scope = Scope::new(name);
        let mut hidden = Scope::default();
        for member in members {
            hidden.claim(&member.name.text);
        }
        for member in members {
            let (mut ty, mut sizes) = self.names.ty(self.library, &member.ty);
            if let Some(element) = elements.get(&member.name.text) {
                (ty, sizes) = (escaped(element), String::new());
            }
            let (annotations, facts) = facts(self.library, member, &hidden);
            if member.optional {
                ty = sequence(&ty, Some(1));
            }
            self.text.doc(&member.doc);
            self.text.doc(&facts);
            let name = scope.unique_name(&member.name.text);
            self.text
                .line(&format!("{annotations}{ty} {}{sizes};", escaped(&name)));
        }
        if members.is_empty() {
            self.text.line(&format!("{nothing} dummy;"));
        }
        self.text.close();
    }
}

/// The annotations of a member, and the documentation of properties that OMG IDL or its compilers
/// cannot annotate. `hidden` has the annotations that a member's name hides.
fn facts(library: &Library, member: &Member, hidden: &Scope) -> (String, Vec<String>) {
    let ty = library.resolved(&member.ty);
    let (mut annotations, mut facts) = (Vec::new(), Vec::new());
    if member.optional {
        facts.push("Optional: none or one.".to_owned());
    }
    if let Some(unit) = &member.unit {
        if hidden.contains("unit") {
            facts.push(format!("Unit: {unit}."));
        } else {
            annotations.push(format!("@unit({})", quoted(unit)));
        }
    }
    // The value of an optional member is an element of a sequence, which has no annotations.
    let one = |literal: &Literal| value(ty, literal).filter(|_| !member.optional && safe(literal));
    if let Some(range) = &member.range {
        let min = range.min.as_ref().map(|min| ("min", one(min)));
        let max = range.max.as_ref().map(|max| ("max", one(max)));
        let (name, arguments) = match (min, max) {
            (Some((_, min)), Some((_, max))) => {
                let both = min.zip(max);
                (
                    "range",
                    both.map(|(min, max)| format!("min={min}, max={max}")),
                )
            }
            (Some(end), None) | (None, Some(end)) => end,
            (None, None) => ("range", None),
        };
        match arguments.filter(|_| !hidden.contains(name)) {
            Some(arguments) => annotations.push(format!("@{name}({arguments})")),
            None => facts.extend(
                crate::view::checks::range_text(member).map(|range| format!("Range: {range}.")),
            ),
        }
    }
    if let Some(default) = &member.default {
        match one(default).filter(|_| !hidden.contains("default")) {
            Some(value) => annotations.push(format!("@default({value})")),
            None => facts.push(format!("Default: {}.", plain(default))),
        }
    }
    let annotations = annotations.iter().map(|a| format!("{a} "));
    (annotations.collect(), facts)
}

/// Whether an annotation can contain the value: Cyclone's compiler limits signed numbers to 32
/// bits.
fn safe(literal: &Literal) -> bool {
    literal
        .as_i64()
        .is_none_or(|value| value > i64::from(i32::MIN))
}

/// A value in OMG IDL. `None` for an enumerator, which annotations cannot contain.
fn value(ty: &Type, literal: &Literal) -> Option<String> {
    let float = matches!(ty, Type::Primitive(p) if p.is_float());
    match &literal.kind {
        LiteralKind::Int(value) if float => Some(format!("{value}.0")),
        LiteralKind::Int(value) => Some(value.to_string()),
        LiteralKind::Float(value) => Some(format!("{value:?}")),
        LiteralKind::String(value) => Some(quoted(value)),
        LiteralKind::Bool(value) => Some(if *value { "TRUE" } else { "FALSE" }.to_owned()),
        LiteralKind::Duration(value) => Some(value.to_string()),
        LiteralKind::Name(_) => None,
    }
}
