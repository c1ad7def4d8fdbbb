//! Loads a file with its imports into one library.

use crate::ast::{self, Decl, DeclKind};
use crate::check;
use crate::model::{Library, Module, ModuleId, Reference, TypeDecl, TypeDeclKind, TypeId};
use crate::parse::parse;
use crate::resolve::is_type;
use crate::resolver::ModuleResolver;
use rc_diagnostics::{Diagnostic, Diagnostics, SourceMap, Span};
use rc_syntax::Loader;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// Loads files that import each other into one [`Library`].
pub struct Session<'a> {
    /// The texts of all loaded files.
    pub sources: &'a mut SourceMap,
    /// Finds imported files.
    pub loader: &'a dyn Loader,
    /// The diagnostics so far.
    pub found: Diagnostics,
    /// The modules resolved so far.
    pub library: Library,
    /// The modules of the files that were loaded, by [`Loader::identity`].
    loaded: HashMap<PathBuf, Option<ModuleId>>,
    /// The chain of files whose imports are being loaded, by [`Loader::identity`].
    loading: Vec<PathBuf>,
    /// The number of unknown names for which a similar name was searched.
    suggestions: usize,
    /// Whether an import failed.
    import_failed: bool,
}

/// The maximum length of a chain of imports.
const MAX_IMPORT_DEPTH: usize = 50;

impl<'a> Session<'a> {
    /// An empty session.
    pub fn new(sources: &'a mut SourceMap, loader: &'a dyn Loader) -> Self {
        Self {
            sources,
            loader,
            found: Diagnostics::new(),
            library: Library::default(),
            loaded: HashMap::new(),
            loading: Vec::new(),
            suggestions: 0,
            import_failed: false,
        }
    }

    /// Loads the file that `from` imports at `span` as `wanted`, with its imports. Reports an error
    /// and returns `None` if that fails.
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
        let module = self.load(&file.path, file.text, span)?;
        let references = &mut self.library.references;
        references.push((span, Reference::Module(module)));
        Some(module)
    }

    /// Loads the text of `path` with its imports. Diagnostics about the import itself refer to
    /// `span`.
    pub fn load(&mut self, path: &Path, text: String, span: Span) -> Option<ModuleId> {
        let identity = self.loader.identity(path);
        if let Some(at) = self.loading.iter().position(|open| *open == identity) {
            let ring = self.loading[at..].iter().chain([&identity]);
            let names: Vec<String> = ring.map(|path| file_name(path)).collect();
            let message = format!("cyclic import: {}", names.join(" → "));
            self.found
                .push(Diagnostic::error("import-cycle", span, message));
            return None;
        }
        if let Some(known) = self.loaded.get(&identity) {
            return *known;
        }
        if self.loading.len() >= MAX_IMPORT_DEPTH {
            let message = format!("imports are nested more than {MAX_IMPORT_DEPTH} levels deep");
            self.found
                .push(Diagnostic::error("nested-too-deep", span, message));
            return None;
        }
        let source = self.sources.add(path, text);
        self.load_source(source, path)
    }

    /// Loads a text that the source map already contains.
    pub fn load_source(
        &mut self,
        source: rc_diagnostics::SourceId,
        path: &Path,
    ) -> Option<ModuleId> {
        // Many components of a network import the same interfaces.
        let parsed = self.sources.cached(source, parse);
        let (file, found) = &*parsed;
        self.found.extend(found.iter().cloned());
        let identity = self.loader.identity(path);
        self.loading.push(identity.clone());
        let mut imports = Vec::new();
        for import in &file.imports {
            let module = self.import(path, &import.text, import.span);
            imports.extend(module.filter(|m| !imports.contains(m)));
        }
        self.loading.pop();
        let module = file.module.as_ref();
        let module = module.map(|module| self.module(module, source, imports));
        self.loaded.insert(identity, module);
        module
    }

    fn resolver(&mut self, module: ModuleId) -> ModuleResolver<'_> {
        ModuleResolver {
            library: &mut self.library,
            found: &mut self.found,
            suggestions: &mut self.suggestions,
            import_failed: self.import_failed,
            module,
        }
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
                "module `{}` is declared in two files: {} and {}",
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
            ros_package: None,
        };
        // Declare all names first: declarations may be in any order.
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
                    DeclKind::Enum(_)
                    | DeclKind::Struct(_)
                    | DeclKind::Alias(_)
                    | DeclKind::Const(..)
                    | DeclKind::Interface(_) => TypeDeclKind::Struct(Vec::new()),
                },
                nesting_depth: 0,
                image: None,
                ros_type: None,
                prototype: None,
            });
        }
        let types = module.types.clone();
        self.library.modules.push(module);
        let mut resolver = self.resolver(id);
        let package = resolver.single_ros_name(&tree.annotations);
        resolver.library.modules[id.0].ros_package = package;
        resolver.consts(&tree.decls);
        // Keys and defaults depend on enums and aliases, which may be declared later.
        let depth = |decl: &Decl| match decl.kind {
            DeclKind::Enum(_) => 0,
            DeclKind::Alias(_) => 1,
            DeclKind::Struct(_)
            | DeclKind::Exception(..)
            | DeclKind::Const(..)
            | DeclKind::Interface(_) => 2,
        };
        let decls = tree.decls.iter().filter(|d| is_type(&d.kind));
        let mut in_order: Vec<(&Decl, &TypeId)> = decls.zip(&types).collect();
        in_order.sort_by_key(|(decl, _)| depth(decl));
        for (decl, ty) in in_order {
            let ros_type = resolver.ros_type(decl);
            let prototype = resolver.prototype(decl);
            let kind = resolver.type_decl(decl);
            let declared = &mut resolver.library.types[ty.0];
            (declared.kind, declared.ros_type) = (kind, ros_type);
            declared.prototype = prototype;
        }
        resolver.bases(&tree.decls, &types);
        check::nesting(&mut self.library, &types, &mut self.found);
        let mut resolver = self.resolver(id);
        for decl in &tree.decls {
            if let DeclKind::Interface(operations) = &decl.kind {
                resolver.interface(decl, operations);
            }
        }
        id
    }
}

fn file_name(path: &Path) -> String {
    path.file_name().map_or_else(
        || path.display().to_string(),
        |n| n.to_string_lossy().into_owned(),
    )
}
