//! Loads the files of a deployment.

use crate::ast;
use crate::parse::parse;
use rc_diagnostics::{Diagnostic, Diagnostics, SourceId, SourceMap, Span};
use rc_syntax::{Loader, Name};
use std::collections::HashMap;
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
/// before the files that import it. Its own is `None` after a syntax error. The third part has the
/// places of all imports.
pub(crate) fn files(
    sources: &mut SourceMap,
    loader: &dyn Loader,
    source: SourceId,
    found: &mut Diagnostics,
) -> (Vec<File>, Option<File>, Vec<(Span, SourceId)>) {
    let mut importer = Importer {
        sources,
        loader,
        found,
        loaded: HashMap::new(),
        imports: Vec::new(),
        open: Vec::new(),
        imported: Vec::new(),
    };
    let main = importer.file(source);
    (importer.imported, main, importer.imports)
}

const EXTENSION: &str = "ddsl";

struct Importer<'a> {
    sources: &'a mut SourceMap,
    loader: &'a dyn Loader,
    found: &'a mut Diagnostics,
    /// The files that were loaded, by [`Loader::identity`].
    loaded: HashMap<PathBuf, SourceId>,
    /// Where files are imported.
    imports: Vec<(Span, SourceId)>,
    /// The chain of files whose imports are being loaded, by [`Loader::identity`].
    open: Vec<PathBuf>,
    imported: Vec<File>,
}

impl Importer<'_> {
    /// Parses a text and loads its imports.
    fn file(&mut self, source: SourceId) -> Option<File> {
        let given = self.sources.path(source).to_path_buf();
        let (file, found) = parse(self.sources, source);
        if self.found.is_empty() {
            // Skips the search for duplicates.
            *self.found = found;
        } else {
            self.found.extend(found);
        }
        let identity = self.loader.identity(&given);
        self.open.push(identity.clone());
        for import in &file.imports {
            self.import(&given, import);
        }
        self.open.pop();
        self.loaded.insert(identity, source);
        Some(File {
            folder: given.parent().unwrap_or(Path::new("")).to_path_buf(),
            tree: file.deployment?,
        })
    }

    fn import(&mut self, from: &Path, wanted: &Name) {
        let Some((path, text)) = self.find(from, wanted) else {
            return;
        };
        let identity = self.loader.identity(&path);
        if let Some(at) = self.open.iter().position(|open| *open == identity) {
            return self.cycle(at, wanted.span);
        }
        let known = self.loaded.get(&identity).copied();
        let source = known.unwrap_or_else(|| {
            let source = self.sources.add(path, text);
            let file = self.file(source);
            self.imported.extend(file);
            source
        });
        self.imports.push((wanted.span, source));
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
