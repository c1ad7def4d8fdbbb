//! Resolves the names of one module and builds its model.

use crate::ast::{self, Decl, DeclKind, Scoped, TypeKind};
use crate::check;
use crate::model::{
    Const, Enumerator, Interface, InterfaceId, Member, Operation, Pattern, Primitive, Range, Type,
    TypeDeclKind, TypeId,
};
use crate::resolver::ModuleResolver;
use rc_diagnostics::Diagnostic;
use rc_syntax::{Literal, Name};
use std::collections::HashMap;
use std::sync::Arc;

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

impl ModuleResolver<'_> {
    pub(crate) fn consts(&mut self, decls: &[Decl]) {
        for decl in decls {
            let DeclKind::Const(tree, value) = &decl.kind else {
                continue;
            };
            let Some(ty) = self.ty(tree) else { continue };
            if !matches!(ty, Type::Primitive(_) | Type::Text { .. }) {
                let message = "invalid type for a constant";
                let help = "use a number, a bool or a string";
                self.report(Diagnostic::error("const-type", tree.span, message).help(help));
                continue;
            }
            check::value_fits(self.library, &ty, value, self.found);
            let constant = Const {
                name: decl.name.clone(),
                doc: decl.doc.clone(),
                ty,
                value: value.clone(),
            };
            self.library.modules[self.module.0].consts.push(constant);
        }
    }

    pub(crate) fn type_decl(&mut self, decl: &Decl) -> TypeDeclKind {
        match &decl.kind {
            DeclKind::Enum(values) => TypeDeclKind::Enum(self.enumerators(decl, values)),
            DeclKind::Struct(members) => TypeDeclKind::Struct(self.members(members)),
            DeclKind::Exception(_, members) => TypeDeclKind::Exception(self.members(members)),
            DeclKind::Alias(tree) => {
                TypeDeclKind::Alias(self.ty(tree).unwrap_or(Type::Text { bound: None }))
            }
            DeclKind::Const(..) | DeclKind::Interface(_) => TypeDeclKind::Struct(Vec::new()),
        }
    }

    fn enumerators(&mut self, decl: &Decl, values: &[ast::Enumerator]) -> Vec<Enumerator> {
        check::duplicates(values.iter().map(|v| &v.name), "enumerator", self.found);
        if values.is_empty() {
            let message = format!("enum `{}` has no values", decl.name.text);
            self.report(Diagnostic::error("empty-enum", decl.name.span, message));
        }
        let mut next = 0_i64;
        let mut out: Vec<Enumerator> = Vec::new();
        let mut taken: HashMap<i64, &Name> = HashMap::new();
        for value in values {
            if let Some(literal) = &value.value {
                match literal.as_i64().filter(|v| i32::try_from(*v).is_ok()) {
                    Some(explicit) => next = explicit,
                    None => self.report(Diagnostic::error(
                        "enum-value",
                        literal.span,
                        "expected a 32-bit integer as the value of an enumerator",
                    )),
                }
            }
            let fits = i32::try_from(next);
            // Reported once, not for each of the following enumerators.
            if next == i64::from(i32::MAX) + 1 {
                let message = format!(
                    "the value of `{}` would be {next}, which is no 32-bit integer",
                    value.name.text
                );
                let diagnostic = Diagnostic::error("enum-value", value.name.span, message);
                self.report(diagnostic.help("give it a value of its own, as in `last = 7`"));
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
                value: fits.unwrap_or(i32::MAX),
            });
            next += 1;
        }
        out
    }

    fn members(&mut self, members: &[ast::Member]) -> Vec<Member> {
        check::duplicates(members.iter().map(|m| &m.name), "member", self.found);
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
            let fits = check::value_fits(self.library, &member.ty, value, self.found);
            if fits && let Some(range) = &member.range {
                check::value_in_range(range, value, &member.name, self.found);
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
            doc: doc.to_vec(),
            ..Member::plain(name.clone(), ty)
        };
        for annotation in annotations {
            self.annotate(&mut member, annotation);
        }
        Some(member)
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
            let inherited = match &self.library.ty(base_id).kind {
                TypeDeclKind::Exception(members) if base_id < *id => members.clone(),
                TypeDeclKind::Enum(_)
                | TypeDeclKind::Struct(_)
                | TypeDeclKind::Exception(_)
                | TypeDeclKind::Alias(_) => {
                    let message = format!(
                        "expected an exception declared before this one, found `{}`",
                        base.text()
                    );
                    self.report(Diagnostic::error("not-an-exception", base.span(), message));
                    continue;
                }
            };
            if let TypeDeclKind::Exception(own) = &mut self.library.types[id.0].kind {
                let all: Vec<Member> = inherited.into_iter().chain(own.drain(..)).collect();
                *own = all;
                check::duplicates(own.iter().map(|m| &m.name), "member", self.found);
            }
        }
    }

    pub(crate) fn interface(&mut self, decl: &Decl, operations: &[ast::Operation]) {
        check::duplicates(operations.iter().map(|o| &o.name), "operation", self.found);
        let operations = operations.iter().map(|o| self.operation(o)).collect();
        let id = InterfaceId(self.library.interfaces.len());
        self.library.modules[self.module.0].interfaces.push(id);
        self.library.interfaces.push(Interface {
            name: decl.name.clone(),
            module: self.module,
            doc: decl.doc.clone(),
            operations,
        });
    }

    fn operation(&mut self, tree: &ast::Operation) -> Operation {
        let ros_types = self.ros_names(&tree.annotations);
        check::duplicates(tree.params.iter().map(|p| &p.name), "parameter", self.found);
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
        let explicit_pattern = pattern.and_then(|p| Pattern::from_word(&p.text));
        let result_range = self.result_range(tree, result.as_ref());
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
            result_range,
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

    /// The range of a result. One of an operation without a result has no effect, which is reported.
    fn result_range(&mut self, tree: &ast::Operation, result: Option<&Type>) -> Option<Range> {
        let mut ranges = tree.annotations.iter().filter(|a| a.name.text == "range");
        let annotation = ranges.next()?;
        let Some(ty) = result else {
            let message = "`@range` is ignored here: the operation has no result";
            let diagnostic =
                Diagnostic::warning("unknown-annotation", annotation.name.span, message);
            self.report(diagnostic.help("move it before a parameter"));
            return None;
        };
        let mut member = Member::plain(tree.name.clone(), ty.clone());
        self.annotate(&mut member, annotation);
        member.range
    }

    fn exception(&mut self, name: &Scoped) -> Option<TypeId> {
        let id = self.named(name)?;
        if matches!(self.library.ty(id).kind, TypeDeclKind::Exception(_)) {
            return Some(id);
        }
        let message = format!("expected an exception, found `{}`", name.text());
        let declared = self.library.ty(id).name.span;
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
                    (&scoped.module, Primitive::from_idsl(&scoped.name.text))
                {
                    return Some(Type::Primitive(primitive));
                }
                if is_void(tree) {
                    let message = "`void` is valid only as the return type of an operation";
                    self.report(Diagnostic::error("void-value", tree.span, message));
                    return None;
                }
                let id = self.named(scoped)?;
                if matches!(self.library.ty(id).kind, TypeDeclKind::Exception(_)) {
                    let message = format!("expected a type, found exception `{}`", scoped.text());
                    let error = Diagnostic::error("exception-as-type", tree.span, message);
                    self.report(error.help("exceptions are valid only after `throws`"));
                    return None;
                }
                Type::Named(id)
            }
            TypeKind::String(bound) => Type::Text {
                bound: self.bound(bound.as_ref()),
            },
            TypeKind::Sequence(element, bound) => Type::Sequence {
                element: Arc::new(self.ty(element)?),
                bound: self.bound(bound.as_ref()),
            },
            TypeKind::Array(element, size) => {
                let size_value = self.bound(Some(size))?;
                Type::Array {
                    element: Arc::new(self.ty(element)?),
                    length: size_value,
                }
            }
            TypeKind::Dictionary(key, value) => {
                let key_type = self.ty(key)?;
                check::dictionary_key(self.library, &key_type, key.span, self.found);
                Type::Dictionary {
                    key: Arc::new(key_type),
                    value: Arc::new(self.ty(value)?),
                }
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
}
