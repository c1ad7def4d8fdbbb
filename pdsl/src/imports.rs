//! Files that import each other: what is declared in them, as if all of it stood in one.

use crate::ast::{Item, Params};
use crate::parse::parse;
use rc_diagnostics::{Diagnostic, Diagnostics, SourceId, SourceMap};
use rc_syntax::{Loader, Name};
use std::collections::HashSet;
use std::path::{Path, PathBuf};

/// A chain of imports longer than this is refused, since the reader calls itself for each of them.
const LONGEST_CHAIN: usize = 50;

/// The declarations of one file and of all that it imports.
pub(crate) struct Imports<'a> {
    pub(crate) sources: &'a mut SourceMap,
    loader: &'a dyn Loader,
    pub(crate) found: Diagnostics,
    /// Those of an imported file before those of the file that imports it, each file once.
    pub(crate) items: Vec<Item>,
    /// The files that were read, and those of them whose imports are being read.
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

    /// Reads a file with all that it imports. What it returns has no items: they are in `items`.
    pub(crate) fn file(&mut self, source: SourceId) -> Option<Params> {
        let path = self.sources.path(source).to_path_buf();
        let (file, found) = parse(self.sources, source);
        self.found.extend(found);
        self.read.insert(path.clone());
        self.open.push(path.clone());
        let mut seen: Vec<(PathBuf, &Name)> = Vec::new();
        for import in &file.imports {
            let Some(imported) = self.import(&path, import) else {
                continue;
            };
            if let Some((_, first)) = seen.iter().find(|(path, _)| *path == imported) {
                let message = format!("`{}` is imported already", import.text);
                self.found.push(
                    Diagnostic::warning("unused-import", import.span, message)
                        .label(first.span, "first here"),
                );
            }
            seen.push((imported, import));
        }
        self.open.pop();
        let mut params = file.params?;
        self.items.append(&mut params.items);
        Some(params)
    }

    /// The path of the imported file; none where something is wrong with the import itself.
    fn import(&mut self, from: &Path, import: &Name) -> Option<PathBuf> {
        let file = match self.loader.find(from, &import.text, "pdsl") {
            Ok(file) => file,
            Err(missing) => {
                let missing = missing.diagnostic(&import.text, "pdsl", import.span);
                self.found.push(missing);
                return None;
            }
        };
        if let Some(at) = self.open.iter().position(|open| *open == file.path) {
            let circle = self.open[at..].iter().chain([&file.path]);
            let names: Vec<String> = circle.map(|path| file_name(path)).collect();
            let message = format!(
                "these files import each other in a circle: {}",
                names.join(" → ")
            );
            self.error("import-cycle", import, message, None);
            return None;
        }
        if self.open.len() >= LONGEST_CHAIN {
            let message = format!("imports nest deeper than {LONGEST_CHAIN} levels here");
            self.error("nested-too-deep", import, message, None);
            return None;
        }
        if !self.read.contains(&file.path) {
            let before = self.items.len();
            let source = self.sources.add(file.path.clone(), file.text);
            if self.file(source).is_some() && self.items.len() == before {
                let message = format!("nothing is declared in `{}`", import.text);
                self.found
                    .push(Diagnostic::warning("unused-import", import.span, message));
            }
        }
        Some(file.path)
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
