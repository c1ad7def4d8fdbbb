//! Resolves the names of one module and builds its model.

use crate::ast::{self, Decl, DeclKind, Scoped, TypeKind};
use crate::check;
use crate::model::{
    Const, Enumerator, Interface, InterfaceId, Member, ModuleId, Operation, Pattern, Primitive,
    Range, Type, TypeDeclKind, TypeId,
};
use crate::session::Session;
use rc_diagnostics::Diagnostic;
use rc_syntax::{Literal, LiteralKind, Name};
use std::collections::HashMap;

/// The number of unknown names per session for which a similar name is searched.
const MAX_SUGGESTIONS: usize = 100;

/// The annotations that members and parameters accept.
const MEMBER_ANNOTATIONS: [&str; 4] = ["unit", "range", "default", "optional"];
/// The annotations that modules, structs and operations accept.
const ALL_ANNOTATIONS: [&str; 5] = ["unit", "range", "default", "optional", "ros"];

/// Whether a declaration declares a named type.
pub(crate) fn is_type(kind: &DeclKind) -> bool {
    matches!(
        kind,
        DeclKind::Enum(_) | DeclKind::Struct(_) | DeclKind::Exception(..) | DeclKind::Alias(_)
    )
}

fn is_void(ty: &ast::Type) -> bool {
    matches!(&ty.kind, TypeKind::Named(Scoped { module: None, name }) if name.text == "void")
}

fn type_named(name: &Name) -> ast::Type {
    ast::Type {
        kind: TypeKind::Named(Scoped {
            module: None,
            name: name.clone(),
        }),
        span: name.span,
    }
}

/// Resolution inside one module.
pub(crate) struct ModuleResolver<'s, 'a> {
    pub(crate) session: &'s mut Session<'a>,
    pub(crate) module: ModuleId,
}

impl ModuleResolver<'_, '_> {
    fn report(&mut self, diagnostic: Diagnostic) {
        self.session.found.push(diagnostic);
    }

    pub(crate) fn consts(&mut self, decls: &[Decl]) {
        for decl in decls {
            let DeclKind::Const(tree, value) = &decl.kind else {
                continue;
            };
            let Some(ty) = self.ty(tree) else { continue };
            if !matches!(ty, Type::Primitive(_) | Type::String(_)) {
                let message = "invalid type for a constant";
                let help = "use a number, a bool or a string";
                self.report(Diagnostic::error("const-type", tree.span, message).help(help));
                continue;
            }
            check::value_fits(&self.session.library, &ty, value, &mut self.session.found);
            let constant = Const {
                name: decl.name.clone(),
                doc: decl.doc.clone(),
                ty,
                value: value.clone(),
            };
            self.session.library.modules[self.module.0]
                .consts
                .push(constant);
        }
    }

    pub(crate) fn type_decl(&mut self, decl: &Decl) -> TypeDeclKind {
        match &decl.kind {
            DeclKind::Enum(values) => TypeDeclKind::Enum(self.enumerators(decl, values)),
            DeclKind::Struct(members) => TypeDeclKind::Struct(self.members(members)),
            DeclKind::Exception(_, members) => TypeDeclKind::Exception(self.members(members)),
            DeclKind::Alias(tree) => {
                TypeDeclKind::Alias(self.ty(tree).unwrap_or(Type::String(None)))
            }
            DeclKind::Const(..) | DeclKind::Interface(_) => TypeDeclKind::Struct(Vec::new()),
        }
    }

    fn enumerators(&mut self, decl: &Decl, values: &[ast::Enumerator]) -> Vec<Enumerator> {
        check::duplicates(
            values.iter().map(|v| &v.name),
            "enumerator",
            &mut self.session.found,
        );
        if values.is_empty() {
            let message = format!("enum `{}` has no values", decl.name.text);
            self.report(Diagnostic::error("empty-enum", decl.name.span, message));
        }
        let mut next = 0_i32;
        let mut out: Vec<Enumerator> = Vec::new();
        let mut taken: HashMap<i32, &Name> = HashMap::new();
        for value in values {
            if let Some(literal) = &value.value {
                match literal.as_i64().and_then(|v| i32::try_from(v).ok()) {
                    Some(explicit) => next = explicit,
                    None => self.report(Diagnostic::error(
                        "enum-value",
                        literal.span,
                        "expected a 32-bit integer as the value of an enumerator",
                    )),
                }
            }
            if let Some(same) = taken.insert(next, &value.name) {
                let message = format!(
                    "`{}` has the same value as `{}`",
                    value.name.text, same.text
                );
                let diagnostic = Diagnostic::error("enum-value", value.name.span, message);
                let diagnostic = diagnostic.label(same.span, "first used here");
                self.report(diagnostic);
            }
            out.push(Enumerator {
                name: value.name.clone(),
                doc: value.doc.clone(),
                value: next,
            });
            next = next.wrapping_add(1);
        }
        out
    }

    fn members(&mut self, members: &[ast::Member]) -> Vec<Member> {
        check::duplicates(
            members.iter().map(|m| &m.name),
            "member",
            &mut self.session.found,
        );
        members
            .iter()
            .filter_map(|m| {
                let member = self.member(&m.name, &m.doc, &m.ty, &m.annotations)?;
                Some(self.with_default(member, m.default.clone()))
            })
            .collect()
    }

    fn with_default(&mut self, mut member: Member, written: Option<Literal>) -> Member {
        if written.is_some() {
            member.default = written;
        }
        if let Some(value) = &member.default {
            let fits = check::value_fits(
                &self.session.library,
                &member.ty,
                value,
                &mut self.session.found,
            );
            if fits && let Some(range) = &member.range {
                check::value_in_range(range, value, &member.name, &mut self.session.found);
            }
        }
        member
    }

    fn member(
        &mut self,
        name: &Name,
        doc: &[String],
        tree: &ast::Type,
        annotations: &[ast::Annotation],
    ) -> Option<Member> {
        let ty = self.ty(tree)?;
        let mut member = Member {
            name: name.clone(),
            doc: doc.to_vec(),
            ty,
            optional: false,
            unit: None,
            range: None,
            default: None,
        };
        for annotation in annotations {
            self.annotate(&mut member, annotation);
        }
        Some(member)
    }

    fn annotate(&mut self, member: &mut Member, annotation: &ast::Annotation) {
        let text = annotation.name.text.as_str();
        let first = annotation.args.first().map(|(_, literal)| literal.clone());
        match (text, first) {
            ("optional", None) => member.optional = true,
            (
                "unit",
                Some(Literal {
                    kind: LiteralKind::String(unit),
                    ..
                }),
            ) => member.unit = Some(unit),
            ("default", Some(value)) => member.default = Some(value),
            ("range", Some(_)) => {
                let end = |wanted: &str| {
                    let arg = annotation
                        .args
                        .iter()
                        .find(|(n, _)| n.as_ref().is_some_and(|n| n.text == wanted));
                    arg.map(|(_, literal)| literal.clone())
                };
                let range = Range {
                    min: end("min"),
                    max: end("max"),
                };
                if check::range(
                    &self.session.library,
                    &member.ty,
                    &range,
                    annotation,
                    &mut self.session.found,
                ) {
                    member.range = Some(range);
                }
            }
            ("optional" | "unit" | "default" | "range", _) => {
                let message = match text {
                    "optional" => "`@optional` takes no argument",
                    "unit" => "`@unit` takes one string: `@unit(\"m/s\")`",
                    "default" => "`@default` takes one value: `@default(0)`",
                    _ => "`@range` takes `min=` and `max=`: `@range(min=0, max=100)`",
                };
                self.report(Diagnostic::error(
                    "annotation-arguments",
                    annotation.name.span,
                    message,
                ));
            }
            _ => self.warn_ignored(annotation, &MEMBER_ANNOTATIONS),
        }
    }

    /// Warns of an annotation that has no meaning here. The known annotations of members are accepted
    /// on structs and operations, as documentation.
    fn warn_ignored(&mut self, annotation: &ast::Annotation, known: &[&str]) {
        let text = annotation.name.text.as_str();
        if known.contains(&text) {
            return;
        }
        let report =
            |message| Diagnostic::warning("unknown-annotation", annotation.name.span, message);
        self.report(if text == "ros" {
            report("`@ros` is ignored here".to_owned())
                .help("move it before a module, a struct or an operation")
        } else {
            report(format!("unknown annotation `@{text}`")).suggest(text, known.iter().copied())
        });
    }

    /// The arguments of all `@ros` annotations.
    fn ros_names(&mut self, annotations: &[ast::Annotation]) -> Vec<Name> {
        let mut all = Vec::new();
        for annotation in annotations {
            if annotation.name.text != "ros" {
                self.warn_ignored(annotation, &ALL_ANNOTATIONS);
                continue;
            }
            match annotation.args.as_slice() {
                [
                    (
                        None,
                        Literal {
                            kind: LiteralKind::String(text),
                            span,
                        },
                    ),
                ] => all.push(Name::new(text.clone(), *span)),
                _ => self.report(Diagnostic::error(
                    "annotation-arguments",
                    annotation.name.span,
                    "`@ros` takes one string: `@ros(\"sensor_msgs/msg/LaserScan\")`",
                )),
            }
        }
        all
    }

    /// The argument of `@ros`, which may occur once.
    pub(crate) fn single_ros_name(&mut self, annotations: &[ast::Annotation]) -> Option<Name> {
        let mut all = self.ros_names(annotations).into_iter();
        let first = all.next();
        for other in all {
            let message = "duplicate annotation `@ros`";
            let diagnostic = Diagnostic::error("annotation-arguments", other.span, message);
            let first = first.as_ref().map_or(other.span, |first| first.span);
            self.report(diagnostic.label(first, "first used here"));
        }
        first
    }

    /// The ROS 2 type that a struct declares with `@ros`.
    pub(crate) fn ros_type(&mut self, decl: &Decl) -> Option<Name> {
        if matches!(decl.kind, DeclKind::Struct(_)) {
            return self.single_ros_name(&decl.annotations);
        }
        for annotation in &decl.annotations {
            self.warn_ignored(annotation, &MEMBER_ANNOTATIONS);
        }
        None
    }

    /// Adds the members of the base of each exception before its own.
    pub(crate) fn bases(&mut self, decls: &[Decl], types: &[TypeId]) {
        for (decl, id) in decls.iter().filter(|d| is_type(&d.kind)).zip(types) {
            let DeclKind::Exception(Some(base), _) = &decl.kind else {
                continue;
            };
            let Some(base_id) = self.named(base) else {
                continue;
            };
            let inherited = match &self.session.library.ty(base_id).kind {
                TypeDeclKind::Exception(members) if base_id < *id => members.clone(),
                _ => {
                    let message = format!(
                        "expected an exception declared before this one, found `{}`",
                        base.text()
                    );
                    self.report(Diagnostic::error("not-an-exception", base.span(), message));
                    continue;
                }
            };
            if let TypeDeclKind::Exception(own) = &mut self.session.library.types[id.0].kind {
                let all: Vec<Member> = inherited.into_iter().chain(own.drain(..)).collect();
                *own = all;
                check::duplicates(
                    own.iter().map(|m| &m.name),
                    "member",
                    &mut self.session.found,
                );
            }
        }
    }

    pub(crate) fn interface(&mut self, decl: &Decl, operations: &[ast::Operation]) {
        check::duplicates(
            operations.iter().map(|o| &o.name),
            "operation",
            &mut self.session.found,
        );
        let operations = operations.iter().map(|o| self.operation(o)).collect();
        let id = InterfaceId(self.session.library.interfaces.len());
        self.session.library.modules[self.module.0]
            .interfaces
            .push(id);
        self.session.library.interfaces.push(Interface {
            name: decl.name.clone(),
            module: self.module,
            doc: decl.doc.clone(),
            operations,
        });
    }

    fn operation(&mut self, tree: &ast::Operation) -> Operation {
        let ros_types = self.ros_names(&tree.annotations);
        check::duplicates(
            tree.params.iter().map(|p| &p.name),
            "parameter",
            &mut self.session.found,
        );
        let (mut inputs, mut outputs) = (Vec::new(), Vec::new());
        for param in &tree.params {
            if let Some(member) = self.member(&param.name, &[], &param.ty, &param.annotations) {
                let member = self.with_default(member, None);
                if param.out {
                    outputs.push(member);
                } else {
                    inputs.push(member);
                }
            }
        }
        let throws = tree
            .throws
            .iter()
            .filter_map(|t| self.exception(t))
            .collect();
        let mut pattern = tree.pattern.as_ref();
        let mut result = tree.result.as_ref().filter(|ty| !is_void(ty));
        // `query get();` if the module declares a type named `query`.
        let named = pattern.filter(|p| tree.result.is_none() && self.own(&p.text).is_some());
        let of_pattern = named.map(type_named);
        if of_pattern.is_some() {
            (pattern, result) = (None, of_pattern.as_ref());
        }
        let written = result.is_some();
        let result = result.and_then(|t| self.ty(t));
        let explicit_pattern = pattern.map(|p| match p.text.as_str() {
            "command" => Pattern::Command,
            "query" => Pattern::Query,
            _ => Pattern::Publish,
        });
        let operation = Operation {
            name: tree.name.clone(),
            doc: tree.doc.clone(),
            explicit_pattern,
            idempotent: tree.idempotent,
            result,
            inputs,
            outputs,
            throws,
            ros_types,
        };
        if let (Some(Pattern::Command | Pattern::Publish), Some(word), true) =
            (explicit_pattern, pattern, operation.has_result() || written)
        {
            let message = format!("{} `{}` cannot have a result", word.text, tree.name.text);
            let help =
                "make it a `query`, or remove the return value, `out` parameters and `throws`";
            self.report(Diagnostic::error("result-of-one-way", word.span, message).help(help));
        }
        operation
    }

    fn exception(&mut self, name: &Scoped) -> Option<TypeId> {
        let id = self.named(name)?;
        if matches!(self.session.library.ty(id).kind, TypeDeclKind::Exception(_)) {
            return Some(id);
        }
        let message = format!("expected an exception, found `{}`", name.text());
        let declared = self.session.library.ty(id).name.span;
        self.report(
            Diagnostic::error("not-an-exception", name.span(), message)
                .label(declared, "declared here"),
        );
        None
    }

    fn ty(&mut self, tree: &ast::Type) -> Option<Type> {
        Some(match &tree.kind {
            TypeKind::Named(scoped) => {
                if let (None, Some(primitive)) =
                    (&scoped.module, Primitive::from_word(&scoped.name.text))
                {
                    return Some(Type::Primitive(primitive));
                }
                if is_void(tree) {
                    let message = "`void` is valid only as the return type of an operation";
                    self.report(Diagnostic::error("void-value", tree.span, message));
                    return None;
                }
                let id = self.named(scoped)?;
                if matches!(self.session.library.ty(id).kind, TypeDeclKind::Exception(_)) {
                    let message = format!("expected a type, found exception `{}`", scoped.text());
                    let error = Diagnostic::error("exception-as-type", tree.span, message);
                    self.report(error.help("exceptions are valid only after `throws`"));
                    return None;
                }
                Type::Named(id)
            }
            TypeKind::String(bound) => Type::String(self.bound(bound.as_ref())),
            TypeKind::Sequence(element, bound) => {
                Type::Sequence(Box::new(self.ty(element)?), self.bound(bound.as_ref()))
            }
            TypeKind::Array(element, size) => {
                let size_value = self.bound(Some(size))?;
                Type::Array(Box::new(self.ty(element)?), size_value)
            }
            TypeKind::Dictionary(key, value) => {
                let key_type = self.ty(key)?;
                check::dictionary_key(
                    &self.session.library,
                    &key_type,
                    key.span,
                    &mut self.session.found,
                );
                Type::Dictionary(Box::new(key_type), Box::new(self.ty(value)?))
            }
        })
    }

    fn bound(&mut self, literal: Option<&Literal>) -> Option<u32> {
        let literal = literal?;
        if let Some(bound) = literal
            .as_i64()
            .and_then(|v| u32::try_from(v).ok())
            .filter(|v| *v > 0)
        {
            Some(bound)
        } else {
            let message = "expected a bound from 1 to 4294967295";
            self.report(Diagnostic::error("bad-bound", literal.span, message));
            None
        }
    }

    /// The type `name` of this module.
    fn own(&self, name: &str) -> Option<TypeId> {
        let module = self.session.library.module(self.module);
        module.types_by_name.get(name).copied()
    }

    fn named(&mut self, scoped: &Scoped) -> Option<TypeId> {
        let library = &self.session.library;
        let wanted = scoped.name.text.as_str();
        let own = |module: ModuleId| library.module(module).types_by_name.get(wanted).copied();
        // The fast path: most names are of this module.
        if scoped.module.is_none()
            && let Some(found) = self.own(wanted)
        {
            return Some(found);
        }
        let reachable = library.reachable(self.module);
        let modules: Vec<ModuleId> = match &scoped.module {
            Some(name) => reachable
                .iter()
                .copied()
                .filter(|m| library.module(*m).name.text == name.text)
                .collect(),
            None => Vec::new(),
        };
        if let Some(found) = modules.iter().find_map(|m| own(*m)) {
            return Some(found);
        }
        let elsewhere: Vec<TypeId> = reachable.iter().filter_map(|m| own(*m)).collect();
        let paths: Vec<String> = elsewhere
            .iter()
            .map(|t| format!("`{}`", library.type_path(*t)))
            .collect();
        let span = scoped.span();
        match (elsewhere.as_slice(), &scoped.module) {
            ([one], None) => {
                let message = format!("unscoped name `{wanted}` refers to {}", paths[0]);
                self.report(
                    Diagnostic::warning("unscoped-name", span, message)
                        .help(format!("write {}", paths[0])),
                );
                return Some(*one);
            }
            (all, module) if all.is_empty() || module.is_some() && modules.is_empty() => {
                let diagnostic = match module {
                    Some(module) if modules.is_empty() => {
                        let known = reachable.iter().map(|m| &library.module(*m).name);
                        let near = rc_diagnostics::nearest(
                            &module.text,
                            known.map(|name| name.text.as_str()),
                        );
                        let message = format!("module `{}` is not imported", module.text);
                        let diagnostic = Diagnostic::error("unknown-module", module.span, message);
                        match near {
                            Some(_) => diagnostic.did_you_mean(near),
                            None if self.session.import_failed => {
                                diagnostic.help("fix the failed import of this file first")
                            }
                            None if !paths.is_empty() => {
                                diagnostic.help(format!("import its file, or write {}", paths[0]))
                            }
                            None => diagnostic.help("import the file that declares it"),
                        }
                    }
                    _ => {
                        let message = format!("unknown type `{}`", scoped.text());
                        // A limit: comparing thousands of names with thousands takes minutes.
                        let near = if self.session.suggestions < MAX_SUGGESTIONS {
                            self.session.suggestions += 1;
                            let words = Primitive::WORDS.iter().map(|(word, _)| *word);
                            let types = reachable.iter().flat_map(|m| &library.module(*m).types);
                            let types = types.map(|t| library.ty(*t).name.text.as_str());
                            rc_diagnostics::nearest(wanted, words.chain(["string"]).chain(types))
                        } else {
                            None
                        };
                        let diagnostic = Diagnostic::error("unknown-type", span, message);
                        match near {
                            Some(_) => diagnostic.did_you_mean(near),
                            None => diagnostic.help("declare it, or import the file that does"),
                        }
                    }
                };
                self.report(diagnostic);
            }
            (_, None) => {
                let message = format!("ambiguous type `{wanted}`: found {}", paths.join(" and "));
                self.report(
                    Diagnostic::error("ambiguous-type", span, message)
                        .help(format!("write {}", paths[0])),
                );
            }
            (_, Some(module)) => {
                let message = format!(
                    "module `{}` has no type `{wanted}`; found {}",
                    module.text,
                    paths.join(" and ")
                );
                self.report(
                    Diagnostic::error("type-moved", span, message)
                        .help(format!("write {}", paths[0])),
                );
            }
        }
        None
    }
}
