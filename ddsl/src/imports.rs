//! Loads the files of a deployment.

use crate::ast;
use crate::parse::parse;
use rc_diagnostics::{Diagnostic, Diagnostics, SourceId, SourceMap, Span};
use rc_syntax::{Loader, Name};
use std::collections::HashSet;
use std::path::{Path, PathBuf};

/// One file of a deployment.
#[derive(Debug)]
pub(crate) struct File {
    /// The folder of the file.
    pub(crate) folder: PathBuf,
    /// Contents of the file.
    pub(crate) tree: ast::Deployment,
}

/// The files that `source` imports directly or indirectly, and its own. Each file occurs once,
/// before the files that import it. Its own is `None` after a syntax error.
pub(crate) fn files(
    sources: &mut SourceMap,
    loader: &dyn Loader,
    source: SourceId,
    found: &mut Diagnostics,
) -> (Vec<File>, Option<File>) {
    let given = sources.path(source).to_path_buf();
    // The caller opened the first file. Use the loader's path for it, to recognize imports of it.
    let name = given.file_name().unwrap_or_default().to_string_lossy();
    let known = loader.find(&given, &name, EXTENSION);
    let path = known.map_or_else(|_| given.clone(), |known| known.path);
    let mut importer = Importer {
        sources,
        loader,
        found,
        loaded: HashSet::new(),
        open: Vec::new(),
        imported: Vec::new(),
    };
    let main = importer.file(source, &given, path);
    (importer.imported, main)
}

const EXTENSION: &str = "ddsl";

struct Importer<'a> {
    sources: &'a mut SourceMap,
    loader: &'a dyn Loader,
    found: &'a mut Diagnostics,
    loaded: HashSet<PathBuf>,
    /// The chain of files whose imports are being loaded.
    open: Vec<PathBuf>,
    imported: Vec<File>,
}

impl Importer<'_> {
    /// Parses a text and loads its imports. `path` is the loader's path for `given`.
    fn file(&mut self, source: SourceId, given: &Path, path: PathBuf) -> Option<File> {
        let (file, found) = parse(self.sources, source);
        if self.found.is_empty() {
            // Skips the search for duplicates.
            *self.found = found;
        } else {
            self.found.extend(found);
        }
        self.open.push(path.clone());
        for import in &file.imports {
            self.import(given, import);
        }
        self.open.pop();
        self.loaded.insert(path);
        Some(File {
            folder: given.parent().unwrap_or(Path::new("")).to_path_buf(),
            tree: file.deployment?,
        })
    }

    fn import(&mut self, from: &Path, wanted: &Name) {
        let Some((path, text)) = self.find(from, wanted) else {
            return;
        };
        if let Some(at) = self.open.iter().position(|open| *open == path) {
            self.cycle(at, wanted.span);
        } else if !self.loaded.contains(&path) {
            let source = self.sources.add(path.clone(), text);
            let file = self.file(source, &path.clone(), path);
            self.imported.extend(file);
        }
    }

    fn cycle(&mut self, at: usize, span: Span) {
        let shown = |path: &PathBuf| {
            let name = path.file_name().unwrap_or(path.as_os_str());
            name.to_string_lossy().into_owned()
        };
        let ring = self.open[at..].iter().chain([&self.open[at]]);
        let message = format!(
            "cyclic import: {}",
            ring.map(shown).collect::<Vec<_>>().join(" → ")
        );
        self.found
            .push(Diagnostic::error("import-cycle", span, message));
    }

    fn find(&mut self, from: &Path, wanted: &Name) -> Option<(PathBuf, String)> {
        let missing = match self.loader.find(from, &wanted.text, EXTENSION) {
            Ok(file) => return Some((file.path, file.text)),
            Err(missing) => missing,
        };
        let missing = missing.diagnostic(&wanted.text, EXTENSION, wanted.span);
        self.found.push(missing);
        None
    }
}
