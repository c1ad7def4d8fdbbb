//! The code in a component's `src/`: which types implement which traits, and what names mean.

use rc_diagnostics::{Diagnostic, Diagnostics, SourceId, SourceMap, Span};
use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::path::{Path, PathBuf};
use syn::{ImplItem, Item, UseTree};

/// The code of a component's user.
#[derive(Default)]
pub(super) struct Code {
    /// All `impl TRAIT for TYPE` outside of functions, in the order of the files.
    pub(super) blocks: Vec<Block>,
    /// The names that files and modules import.
    pub(super) scopes: Vec<Scope>,
    /// Names of types that the user declares.
    pub(super) own: BTreeSet<String>,
}

/// One `impl TRAIT for TYPE`.
pub(super) struct Block {
    /// The trait's name in its own crate.
    pub(super) name: String,
    /// The types that the trait is given. `None` is a parameter of the `impl`: any type.
    pub(super) arguments: Vec<Option<String>>,
    /// The last name of the type.
    pub(super) worker: String,
    /// Whether the trait certainly comes from the generated crate.
    pub(super) generated: bool,
    /// The place of the trait's name.
    pub(super) span: Span,
    /// Scope, an index of [`Code::scopes`].
    pub(super) scope: usize,
    /// Functions of the block.
    pub(super) methods: Vec<Method>,
}

/// One function of a block.
pub(super) struct Method {
    pub(super) name: String,
    /// The place of its name.
    pub(super) span: Span,
    /// Parsed signature.
    pub(super) signature: syn::Signature,
}

/// A file or a module in it.
#[derive(Default)]
pub(super) struct Scope {
    /// Imported names, each with the name that it has where it is declared.
    names: BTreeMap<String, String>,
    /// The names that come from the generated crate.
    generated: BTreeSet<String>,
    /// Whether a glob imports all names of the generated crate.
    everything: bool,
}

impl Scope {
    /// Whether a name of the generated crate may be used here.
    pub(super) fn has(&self, name: &str) -> bool {
        self.everything || self.names.contains_key(name)
    }
}

/// Reads all of `src`. It reports files that are not Rust and skips them. Fails if the system
/// cannot read a file.
pub(super) fn read(
    src: &Path,
    krate: &str,
    sources: &mut SourceMap,
    found: &mut Diagnostics,
) -> io::Result<Code> {
    let mut paths = Vec::new();
    list(src, &mut paths)?;
    paths.sort();
    let mut code = Code::default();
    for path in paths {
        let text = match rc_files::read(&path) {
            Ok(text) => text,
            Err(error) if error.kind() == io::ErrorKind::InvalidData => {
                let bytes = rc_files::read_bytes(&path).map_err(|e| named(&path, &e))?;
                found.push(crate::load::not_utf8(&path, &bytes, sources));
                continue;
            }
            Err(error) => return Err(named(&path, &error)),
        };
        let source = sources.add(&path, text);
        let text = sources.text(source);
        if let Some(at) = too_deep(text) {
            let message = format!("brackets nest deeper than {DEEPEST} levels here");
            let span = Span::new(source, at, at + 1);
            found.push(Diagnostic::error("not-rust", span, message));
            continue;
        }
        match syn::parse_file(text) {
            Ok(file) => {
                let before = file.shebang.as_ref().map_or(0, String::len);
                let mut visitor = Visitor {
                    source,
                    before,
                    krate,
                    code: &mut code,
                };
                visitor.scope(&file.items);
                visitor.blocks(file.items);
            }
            Err(error) => found.push(unreadable(source, text, &error)),
        }
    }
    Ok(code)
}

/// The deepest nesting that is parsed: `syn` calls itself for each level.
const DEEPEST: usize = 500;

/// The place where brackets nest too deep. Brackets in strings and comments count, too: it is only
/// a bound.
fn too_deep(text: &str) -> Option<usize> {
    let mut depth = 0_usize;
    text.bytes().position(|byte| {
        match byte {
            b'(' | b'[' | b'{' => depth += 1,
            b')' | b']' | b'}' => depth = depth.saturating_sub(1),
            _ => {}
        }
        depth > DEEPEST
    })
}

fn unreadable(source: SourceId, text: &str, error: &syn::Error) -> Diagnostic {
    let (range, why) = (error.span().byte_range(), error.to_string());
    let end = text.trim_end().len();
    // An error at the end of the text has no place of its own.
    let range = if range == (0..0) && why.starts_with("unexpected end") {
        end..end
    } else {
        range.start.min(end)..range.end.min(end)
    };
    let message = if why.contains("token stream") {
        "this cannot be read as Rust from here on".to_owned()
    } else {
        format!("this cannot be read as Rust: {why}")
    };
    Diagnostic::error(
        "not-rust",
        Span::new(source, range.start, range.end),
        message,
    )
    .help("`cargo check` says more")
}

fn list(folder: &Path, out: &mut Vec<PathBuf>) -> io::Result<()> {
    for entry in std::fs::read_dir(folder).map_err(|e| named(folder, &e))? {
        let entry = entry?;
        let path = entry.path();
        if entry.file_type()?.is_dir() {
            list(&path, out)?;
        } else if path.extension().is_some_and(|e| e == "rs") {
            out.push(path);
        }
    }
    Ok(())
}

fn named(path: &Path, error: &io::Error) -> io::Error {
    io::Error::new(error.kind(), format!("{}: {error}", path.display()))
}

struct Visitor<'a> {
    source: SourceId,
    /// Bytes of a first line `#!…`, which `syn` does not count.
    before: usize,
    krate: &'a str,
    code: &'a mut Code,
}

impl Visitor<'_> {
    /// Opens the scope of a file or a module: `use` lines may come after their first use.
    fn scope(&mut self, items: &[Item]) {
        let mut scope = Scope::default();
        for item in items {
            let own = match item {
                Item::Use(item) => {
                    self.imports(&item.tree, None, &mut scope);
                    continue;
                }
                Item::Struct(item) => &item.ident,
                Item::Enum(item) => &item.ident,
                Item::Type(item) => &item.ident,
                Item::Union(item) => &item.ident,
                _ => continue,
            };
            self.code.own.insert(name(own));
        }
        self.code.scopes.push(scope);
    }

    /// `from` says whether the path began with the generated crate.
    fn imports(&mut self, tree: &UseTree, from: Option<bool>, scope: &mut Scope) {
        match tree {
            UseTree::Path(path) => {
                let generated = from.unwrap_or_else(|| path.ident == self.krate);
                self.imports(&path.tree, Some(generated), scope);
            }
            UseTree::Group(group) => {
                let trees = group.items.iter();
                trees.for_each(|tree| self.imports(tree, from, scope));
            }
            UseTree::Glob(_) => scope.everything |= from == Some(true),
            UseTree::Name(tree) => {
                let local = name(&tree.ident);
                if from == Some(true) {
                    scope.generated.insert(local.clone());
                }
                scope.names.insert(local.clone(), local);
            }
            UseTree::Rename(tree) => {
                let local = name(&tree.rename);
                if from == Some(true) {
                    scope.generated.insert(local.clone());
                }
                self.code.own.insert(local.clone());
                scope.names.insert(local, name(&tree.ident));
            }
        }
    }

    fn blocks(&mut self, items: Vec<Item>) {
        let scope = self.code.scopes.len() - 1;
        for item in items {
            match item {
                Item::Impl(item) => self.block(item, scope),
                Item::Mod(item) => {
                    if let Some((_, items)) = item.content {
                        self.scope(&items);
                        self.blocks(items);
                    }
                }
                _ => {}
            }
        }
    }

    fn block(&mut self, item: syn::ItemImpl, scope: usize) {
        let (Some((_, path, _)), syn::Type::Path(worker)) = (&item.trait_, &*item.self_ty) else {
            return;
        };
        let (Some(first), Some(last), Some(worker)) = (
            path.segments.first(),
            path.segments.last(),
            worker.path.segments.last(),
        ) else {
            return;
        };
        let imports = &self.code.scopes[scope];
        let local = name(&last.ident);
        let alone = path.segments.len() == 1;
        let home = imports.names.get(&local).filter(|_| alone);
        let generated = if alone {
            imports.generated.contains(&local)
        } else {
            first.ident == self.krate
        };
        let (trait_name, span) = (home.unwrap_or(&local).clone(), self.span(&last.ident));
        let worker = name(&worker.ident);
        let arguments = match &last.arguments {
            syn::PathArguments::AngleBracketed(list) => {
                let parameters: Vec<&syn::Ident> =
                    item.generics.type_params().map(|p| &p.ident).collect();
                let arguments = list.args.iter();
                arguments
                    .map(|argument| argument_name(argument, &parameters, imports))
                    .collect()
            }
            _ => Vec::new(),
        };
        let methods = item.items.into_iter().filter_map(|item| match item {
            ImplItem::Fn(function) => Some(Method {
                name: name(&function.sig.ident),
                span: self.span(&function.sig.ident),
                signature: function.sig,
            }),
            _ => None,
        });
        let methods = methods.collect();
        self.code.blocks.push(Block {
            name: trait_name,
            arguments,
            worker,
            generated,
            span,
            scope,
            methods,
        });
    }

    fn span(&self, ident: &syn::Ident) -> Span {
        let range = ident.span().byte_range();
        Span::new(
            self.source,
            self.before + range.start,
            self.before + range.end,
        )
    }
}

/// The last name of a type, as it is declared; `None` for a type parameter of the `impl`. A type
/// without a name has an empty one.
fn argument_name(
    argument: &syn::GenericArgument,
    parameters: &[&syn::Ident],
    imports: &Scope,
) -> Option<String> {
    let syn::GenericArgument::Type(syn::Type::Path(path)) = argument else {
        return Some(String::new());
    };
    let Some(last) = path.path.segments.last() else {
        return Some(String::new());
    };
    if path.path.segments.len() > 1 {
        return Some(name(&last.ident));
    }
    if parameters.contains(&&last.ident) {
        return None;
    }
    let local = name(&last.ident);
    Some(imports.names.get(&local).cloned().unwrap_or(local))
}

/// `r#match` is the name `match`.
fn name(ident: &syn::Ident) -> String {
    let text = ident.to_string();
    text.strip_prefix("r#").unwrap_or(&text).to_owned()
}
