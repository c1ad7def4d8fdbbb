//! Loads a file with all its imports.

use crate::ast::{Item, Params};
use crate::parse::parse;
use rc_diagnostics::{Diagnostic, Diagnostics, SourceId, SourceMap};
use rc_syntax::{Loader, Name};
use std::collections::HashSet;
use std::path::{Path, PathBuf};

/// The longest chain of imports. The loader is recursive.
const LONGEST_CHAIN: usize = 50;

/// The declarations of a file and of its imports.
pub(crate) struct Imports<'a> {
    pub(crate) sources: &'a mut SourceMap,
    loader: &'a dyn Loader,
    pub(crate) found: Diagnostics,
    /// The declarations. Those of an imported file precede those of the importing file; each file
    /// is included once.
    pub(crate) items: Vec<Item>,
    /// All loaded files, and those whose imports are being loaded, by [`Loader::identity`].
    read: HashSet<PathBuf>,
    open: Vec<PathBuf>,
}

impl<'a> Imports<'a> {
    pub(crate) fn new(sources: &'a mut SourceMap, loader: &'a dyn Loader) -> Self {
        Self {
            sources,
            loader,
            found: Diagnostics::new(),
            items: Vec::new(),
            read: HashSet::new(),
            open: Vec::new(),
        }
    }

    /// Loads a file with its imports. Moves the declarations into `items`.
    pub(crate) fn file(&mut self, source: SourceId) -> Option<Params> {
        let path = self.sources.path(source).to_path_buf();
        let (file, found) = parse(self.sources, source);
        self.found.extend(found);
        let identity = self.loader.identity(&path);
        self.read.insert(identity.clone());
        self.open.push(identity);
        let mut seen: Vec<(PathBuf, &Name)> = Vec::new();
        for import in &file.imports {
            let Some(imported) = self.import(&path, import) else {
                continue;
            };
            if let Some((_, first)) = seen.iter().find(|(path, _)| *path == imported) {
                let message = format!("duplicate import `{}`", import.text);
                self.found.push(
                    Diagnostic::warning("unused-import", import.span, message)
                        .label(first.span, "first imported here"),
                );
            }
            seen.push((imported, import));
        }
        self.open.pop();
        let mut params = file.params?;
        self.items.append(&mut params.items);
        Some(params)
    }

    /// The identity of an imported file. Reports an error and returns `None` if the import is
    /// invalid.
    fn import(&mut self, from: &Path, import: &Name) -> Option<PathBuf> {
        let file = match self.loader.find(from, &import.text, "pdsl") {
            Ok(file) => file,
            Err(missing) => {
                let missing = missing.diagnostic(&import.text, "pdsl", import.span);
                self.found.push(missing);
                return None;
            }
        };
        let identity = self.loader.identity(&file.path);
        if let Some(at) = self.open.iter().position(|open| *open == identity) {
            let circle = self.open[at..].iter().chain([&identity]);
            let names: Vec<String> = circle.map(|path| file_name(path)).collect();
            let message = format!("cyclic import: {}", names.join(" → "));
            self.error("import-cycle", import, message, None);
            return None;
        }
        if self.open.len() >= LONGEST_CHAIN {
            let message = format!("imports are nested more than {LONGEST_CHAIN} levels deep");
            self.error("nested-too-deep", import, message, None);
            return None;
        }
        if !self.read.contains(&identity) {
            let before = self.items.len();
            let source = self.sources.add(file.path.clone(), file.text);
            if self.file(source).is_some() && self.items.len() == before {
                let message = format!("`{}` declares nothing", import.text);
                self.found
                    .push(Diagnostic::warning("unused-import", import.span, message));
            }
        }
        Some(identity)
    }

    fn error(&mut self, code: &'static str, at: &Name, message: String, help: Option<String>) {
        let diagnostic = Diagnostic::error(code, at.span, message);
        self.found.push(match help {
            Some(help) => diagnostic.help(help),
            None => diagnostic,
        });
    }
}

fn file_name(path: &Path) -> String {
    path.file_name().map_or_else(
        || path.display().to_string(),
        |name| name.to_string_lossy().into_owned(),
    )
}
