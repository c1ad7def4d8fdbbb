//! From trees to the model: imports are loaded, names become references.

use crate::ast::{self, Decl, DeclKind, Scoped, TypeKind};
use crate::check;
use crate::model::{
    Const, Enumerator, Interface, InterfaceId, Library, Member, Module, ModuleId, Operation,
    Pattern, Primitive, Range, Type, TypeDecl, TypeDeclKind, TypeId,
};
use crate::parse::parse;
use rc_diagnostics::{Diagnostic, Diagnostics, SourceMap, Span};
use rc_syntax::{Literal, LiteralKind, Loader, Name};
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// One loading of files that import each other.
pub struct Session<'a> {
    /// Receives every text that is read.
    pub sources: &'a mut SourceMap,
    /// Finds the texts.
    pub loader: &'a dyn Loader,
    /// What was found wrong so far.
    pub found: Diagnostics,
    /// What was resolved so far.
    pub library: Library,
    loaded: HashMap<PathBuf, Option<ModuleId>>,
    loading: Vec<(PathBuf, Span)>,
    suggested: usize,
    import_failed: bool,
}

/// So many files may be open because each is imported by the one before.
const MOST_IMPORTS: usize = 50;

/// So many unknown names get a suggestion.
const MOST_SUGGESTIONS: usize = 100;

impl<'a> Session<'a> {
    /// Nothing loaded yet.
    pub fn new(sources: &'a mut SourceMap, loader: &'a dyn Loader) -> Self {
        Self {
            sources,
            loader,
            found: Diagnostics::new(),
            library: Library::default(),
            loaded: HashMap::new(),
            loading: Vec::new(),
            suggested: 0,
            import_failed: false,
        }
    }

    /// Loads what `from` imports at `span` as `wanted`, with all that it imports; none where that failed.
    pub fn import(&mut self, from: &Path, wanted: &str, span: Span) -> Option<ModuleId> {
        let file = match self.loader.find(from, wanted, "idsl") {
            Ok(file) => file,
            Err(missing) => {
                self.import_failed = true;
                let missing = missing.diagnostic(wanted, "idsl", span);
                self.found.push(missing);
                return None;
            }
        };
        self.load(file.path, file.text, span)
    }

    /// Loads one text, which was named at `span`, with all that it imports.
    pub fn load(&mut self, path: PathBuf, text: String, span: Span) -> Option<ModuleId> {
        if let Some(at) = self.loading.iter().position(|(open, _)| *open == path) {
            let mut names: Vec<String> = self.loading[at..]
                .iter()
                .map(|(p, _)| file_name(p))
                .collect();
            names.push(file_name(&path));
            let message = format!(
                "these files import each other in a circle: {}",
                names.join(" → ")
            );
            self.found
                .push(Diagnostic::error("import-cycle", span, message));
            return None;
        }
        if let Some(known) = self.loaded.get(&path) {
            return *known;
        }
        if self.loading.len() >= MOST_IMPORTS {
            let message = format!("files import each other more than {MOST_IMPORTS} levels deep");
            self.found
                .push(Diagnostic::error("nested-too-deep", span, message));
            return None;
        }
        let source = self.sources.add(path.clone(), text);
        self.load_source(source, path, span)
    }

    /// Resolves a text that is in the source map already.
    pub fn load_source(
        &mut self,
        source: rc_diagnostics::SourceId,
        path: PathBuf,
        span: Span,
    ) -> Option<ModuleId> {
        let (file, found) = parse(self.sources, source);
        self.found.extend(found);
        self.loading.push((path.clone(), span));
        let mut imports = Vec::new();
        for import in &file.imports {
            let module = self.import(&path, &import.text, import.span);
            imports.extend(module.filter(|m| !imports.contains(m)));
        }
        self.loading.pop();
        let module = file
            .module
            .map(|module| self.module(&module, source, imports));
        self.loaded.insert(path, module);
        module
    }

    fn module(
        &mut self,
        tree: &ast::Module,
        source: rc_diagnostics::SourceId,
        imports: Vec<ModuleId>,
    ) -> ModuleId {
        let id = ModuleId(self.library.modules.len());
        if let Some(other) = self
            .library
            .modules
            .iter()
            .find(|m| m.name.text == tree.name.text)
        {
            let message = format!(
                "module `{}` is in two files: {} and {}",
                tree.name.text,
                self.sources.path(other.source).display(),
                self.sources.path(source).display()
            );
            let diagnostic = Diagnostic::error("module-in-two-files", tree.name.span, message);
            self.found
                .push(diagnostic.label(other.name.span, "also declared here"));
        }
        check::duplicates(
            tree.decls.iter().map(|d| &d.name),
            "declaration",
            &mut self.found,
        );
        let mut module = Module {
            name: tree.name.clone(),
            doc: tree.doc.clone(),
            source,
            imports,
            types: Vec::new(),
            types_by_name: HashMap::new(),
            interfaces: Vec::new(),
            consts: Vec::new(),
        };
        // Names first, so that declarations may stand in any order.
        for decl in tree.decls.iter().filter(|d| is_type(&d.kind)) {
            let ty = TypeId(self.library.types.len());
            module.types.push(ty);
            let name = decl.name.text.clone();
            module.types_by_name.entry(name).or_insert(ty);
            self.library.types.push(TypeDecl {
                name: decl.name.clone(),
                module: id,
                doc: decl.doc.clone(),
                kind: match decl.kind {
                    DeclKind::Exception(..) => TypeDeclKind::Exception(Vec::new()),
                    _ => TypeDeclKind::Struct(Vec::new()),
                },
                levels: 0,
                plain: false,
            });
        }
        let types = module.types.clone();
        self.library.modules.push(module);
        let mut scope = Scope {
            session: self,
            module: id,
        };
        scope.consts(&tree.decls);
        // Keys and defaults look into enums and aliases, wherever in the file these stand.
        let depth = |decl: &Decl| match decl.kind {
            DeclKind::Enum(_) => 0,
            DeclKind::Alias(_) => 1,
            _ => 2,
        };
        let decls = tree.decls.iter().filter(|d| is_type(&d.kind));
        let mut in_order: Vec<(&Decl, &TypeId)> = decls.zip(&types).collect();
        in_order.sort_by_key(|(decl, _)| depth(decl));
        for (decl, ty) in in_order {
            let kind = scope.type_decl(decl);
            scope.session.library.types[ty.0].kind = kind;
        }
        scope.bases(&tree.decls, &types);
        check::nesting(&mut self.library, &types, &mut self.found);
        let mut scope = Scope {
            session: self,
            module: id,
        };
        for decl in &tree.decls {
            if let DeclKind::Interface(operations) = &decl.kind {
                scope.interface(decl, operations);
            }
        }
        id
    }
}

fn is_type(kind: &DeclKind) -> bool {
    matches!(
        kind,
        DeclKind::Enum(_) | DeclKind::Struct(_) | DeclKind::Exception(..) | DeclKind::Alias(_)
    )
}

fn is_void(ty: &ast::Type) -> bool {
    matches!(&ty.kind, TypeKind::Named(Scoped { module: None, name }) if name.text == "void")
}

fn type_called(name: &Name) -> ast::Type {
    ast::Type {
        kind: TypeKind::Named(Scoped {
            module: None,
            name: name.clone(),
        }),
        span: name.span,
    }
}

fn file_name(path: &Path) -> String {
    path.file_name().map_or_else(
        || path.display().to_string(),
        |n| n.to_string_lossy().into_owned(),
    )
}

/// Resolution inside one module.
struct Scope<'s, 'a> {
    session: &'s mut Session<'a>,
    module: ModuleId,
}

impl Scope<'_, '_> {
    fn report(&mut self, diagnostic: Diagnostic) {
        self.session.found.push(diagnostic);
    }

    fn consts(&mut self, decls: &[Decl]) {
        for decl in decls {
            let DeclKind::Const(tree, value) = &decl.kind else {
                continue;
            };
            let Some(ty) = self.ty(tree) else { continue };
            if !matches!(ty, Type::Primitive(_) | Type::Text(_)) {
                let message = "a constant is a number, a bool or a string";
                self.report(Diagnostic::error("const-type", tree.span, message));
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

    fn type_decl(&mut self, decl: &Decl) -> TypeDeclKind {
        decl.annotations.iter().for_each(|a| self.ignored(a));
        match &decl.kind {
            DeclKind::Enum(values) => TypeDeclKind::Enum(self.enumerators(decl, values)),
            DeclKind::Struct(members) => TypeDeclKind::Struct(self.members(members)),
            DeclKind::Exception(_, members) => TypeDeclKind::Exception(self.members(members)),
            DeclKind::Alias(tree) => TypeDeclKind::Alias(self.ty(tree).unwrap_or(Type::Text(None))),
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
                        "the value of an enumerator is a whole number of 32 bits",
                    )),
                }
            }
            if let Some(same) = taken.insert(next, &value.name) {
                let message = format!(
                    "`{}` has the same value as `{}`",
                    value.name.text, same.text
                );
                let diagnostic = Diagnostic::error("enum-value", value.name.span, message);
                let diagnostic = diagnostic.label(same.span, "the first one");
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
                    kind: LiteralKind::Text(unit),
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
                    "unit" => "`@unit` takes one text: `@unit(\"m/s\")`",
                    "default" => "`@default` takes one value: `@default(0)`",
                    _ => "`@range` takes `min=` and `max=`: `@range(min=0, max=100)`",
                };
                self.report(Diagnostic::error(
                    "annotation-arguments",
                    annotation.name.span,
                    message,
                ));
            }
            _ => self.ignored(annotation),
        }
    }

    /// On a structure or an operation an annotation documents; one that nobody knows is a slip all the same.
    fn ignored(&mut self, annotation: &ast::Annotation) {
        const KNOWN: [&str; 4] = ["unit", "range", "default", "optional"];
        let text = annotation.name.text.as_str();
        if KNOWN.contains(&text) {
            return;
        }
        let message = format!("unknown annotation `@{text}` is ignored");
        let span = annotation.name.span;
        self.report(Diagnostic::warning("unknown-annotation", span, message).suggest(text, KNOWN));
    }

    /// Members of an exception's base come before its own.
    fn bases(&mut self, decls: &[Decl], types: &[TypeId]) {
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
                        "`{}` is not an exception declared before this one",
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

    fn interface(&mut self, decl: &Decl, operations: &[ast::Operation]) {
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
        tree.annotations.iter().for_each(|a| self.ignored(a));
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
        // `query get();` where somebody has called a type `query`.
        let named = pattern.filter(|p| tree.result.is_none() && self.own(&p.text).is_some());
        let of_pattern = named.map(type_called);
        if of_pattern.is_some() {
            (pattern, result) = (None, of_pattern.as_ref());
        }
        let written = result.is_some();
        let result = result.and_then(|t| self.ty(t));
        let marked = pattern.map(|p| match p.text.as_str() {
            "command" => Pattern::Command,
            "query" => Pattern::Query,
            _ => Pattern::Publish,
        });
        let operation = Operation {
            name: tree.name.clone(),
            doc: tree.doc.clone(),
            marked,
            idempotent: tree.idempotent,
            result,
            inputs,
            outputs,
            throws,
        };
        if let (Some(Pattern::Command | Pattern::Publish), Some(word), true) =
            (marked, pattern, operation.has_result() || written)
        {
            let message = format!(
                "`{}` is a {} and cannot have a result",
                tree.name.text, word.text
            );
            let help = "a query has results: a return value, `out` parameters or `throws`";
            self.report(Diagnostic::error("result-of-one-way", word.span, message).help(help));
        }
        operation
    }

    fn exception(&mut self, name: &Scoped) -> Option<TypeId> {
        let id = self.named(name)?;
        if matches!(self.session.library.ty(id).kind, TypeDeclKind::Exception(_)) {
            return Some(id);
        }
        let message = format!("`{}` is not an exception", name.text());
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
                    let message = "`void` is only possible as the result of an operation";
                    self.report(Diagnostic::error("void-value", tree.span, message));
                    return None;
                }
                let id = self.named(scoped)?;
                if matches!(self.session.library.ty(id).kind, TypeDeclKind::Exception(_)) {
                    let message = format!(
                        "exception `{}` is only possible after `throws`",
                        scoped.text()
                    );
                    self.report(Diagnostic::error("exception-as-type", tree.span, message));
                    return None;
                }
                Type::Named(id)
            }
            TypeKind::Text(bound) => Type::Text(self.bound(bound.as_ref())),
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
            let message = "a bound is a whole number from 1 to 4294967295";
            self.report(Diagnostic::error("bad-bound", literal.span, message));
            None
        }
    }

    /// The type of this name in this module.
    fn own(&self, name: &str) -> Option<TypeId> {
        let module = self.session.library.module(self.module);
        module.types_by_name.get(name).copied()
    }

    fn named(&mut self, scoped: &Scoped) -> Option<TypeId> {
        let library = &self.session.library;
        let wanted = scoped.name.text.as_str();
        let own = |module: ModuleId| library.module(module).types_by_name.get(wanted).copied();
        // Nearly always the first place to look is the right one.
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
                let message = format!("`{wanted}` is not in this module; {} is taken", paths[0]);
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
                        let message = format!("module `{}` is not imported here", module.text);
                        let diagnostic = Diagnostic::error("unknown-module", module.span, message);
                        match near {
                            Some(_) => diagnostic.help_nearest(near),
                            None if self.session.import_failed => {
                                diagnostic.help("an import of this file was not found")
                            }
                            None if !paths.is_empty() => {
                                diagnostic.help(format!("import its file, or write {}", paths[0]))
                            }
                            None => diagnostic.help("import the file that declares it"),
                        }
                    }
                    _ => {
                        let message = format!("unknown type `{}`", scoped.text());
                        // A thousand wrong names among ten thousand right ones would take minutes.
                        let near = if self.session.suggested < MOST_SUGGESTIONS {
                            self.session.suggested += 1;
                            let words = Primitive::WORDS.iter().map(|(word, _)| *word);
                            let types = reachable.iter().flat_map(|m| &library.module(*m).types);
                            let types = types.map(|t| library.ty(*t).name.text.as_str());
                            rc_diagnostics::nearest(wanted, words.chain(["string"]).chain(types))
                        } else {
                            None
                        };
                        let diagnostic = Diagnostic::error("unknown-type", span, message);
                        match near {
                            Some(_) => diagnostic.help_nearest(near),
                            None => diagnostic.help("declare it, or import the file that does"),
                        }
                    }
                };
                self.report(diagnostic);
            }
            (_, None) => {
                let message = format!("`{wanted}` is in several modules: {}", paths.join(", "));
                self.report(
                    Diagnostic::error("ambiguous-type", span, message)
                        .help(format!("write {}", paths[0])),
                );
            }
            (_, Some(module)) => {
                let message = format!(
                    "`{wanted}` is not in module `{}`; it is {}",
                    module.text,
                    paths.join(", ")
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
