//! Loads a file with all its imports.

use crate::DOMAINS;
use crate::ast::Domain;
use crate::parse::parse;
use rc_diagnostics::{Diagnostic, Diagnostics, SourceId, SourceMap};
use rc_prototypes::model::Library;
use rc_syntax::{ImportedFile, Loader, Name};
use std::collections::HashSet;
use std::path::{Path, PathBuf};

/// The longest chain of imports. The loader is recursive.
const LONGEST_CHAIN: usize = 64;

/// The file that `from` names as `wanted`, or the domain of this name that comes with this crate.
pub(crate) fn find(
    loader: &dyn Loader,
    from: &Path,
    wanted: &Name,
) -> Result<ImportedFile, Diagnostic> {
    let mut missing = match loader.find(from, &wanted.text, "gdsl") {
        Ok(file) => return Ok(file),
        Err(missing) => missing,
    };
    let base = wanted.text.rsplit('/').next().unwrap_or_default();
    let known = DOMAINS
        .iter()
        .find(|(name, _)| *name == base || name.strip_suffix(".gdsl").is_some_and(|n| n == base));
    let Some((name, text)) = known else {
        let domains = DOMAINS.iter().map(|(name, _)| (*name).to_owned());
        missing.known.extend(domains);
        return Err(missing.diagnostic(&wanted.text, "gdsl", wanted.span));
    };
    Ok(ImportedFile {
        path: PathBuf::from(name),
        text: (*text).to_owned(),
    })
}

/// The domains of a file and of its imports.
pub(crate) struct Imports<'a> {
    sources: &'a mut SourceMap,
    loader: &'a dyn Loader,
    pub(crate) found: Diagnostics,
    /// Domains of imported files come before that of the importing one; each file is there once.
    pub(crate) domains: Vec<Domain>,
    /// The imports of data prototypes, with the files that have them.
    pub(crate) prototypes: Vec<(PathBuf, Name)>,
    read: HashSet<PathBuf>,
    open: Vec<PathBuf>,
}

impl<'a> Imports<'a> {
    pub(crate) fn new(sources: &'a mut SourceMap, loader: &'a dyn Loader) -> Self {
        Self {
            sources,
            loader,
            found: Diagnostics::new(),
            domains: Vec::new(),
            prototypes: Vec::new(),
            read: HashSet::new(),
            open: Vec::new(),
        }
    }

    /// The prototypes that all files import. `None` if their files have errors.
    pub(crate) fn library(&mut self) -> Option<Library> {
        let wanted = self.prototypes.iter();
        let wanted = wanted.map(|(from, file)| (from.as_path(), file));
        let (library, found) = rc_prototypes::import(self.sources, self.loader, wanted);
        let is_right = !found.has_errors();
        self.found.extend(found);
        is_right.then_some(library)
    }

    pub(crate) fn file(&mut self, source: SourceId) {
        let path = self.sources.path(source).to_path_buf();
        let (file, found) = parse(self.sources, source);
        self.found.extend(found);
        let identity = self.loader.identity(&path);
        self.read.insert(identity.clone());
        self.open.push(identity);
        for import in file.imports {
            let ending = Path::new(&import.text).extension();
            if ending.is_some_and(|ending| ending == "dproto") {
                self.prototypes.push((path.clone(), import));
            } else {
                self.import(&path, &import);
            }
        }
        self.open.pop();
        self.domains.extend(file.domain);
    }

    fn import(&mut self, from: &Path, import: &Name) {
        let file = match find(self.loader, from, import) {
            Ok(file) => file,
            Err(missing) => return self.found.push(missing),
        };
        let identity = self.loader.identity(&file.path);
        if self.open.contains(&identity) {
            let message = format!("cyclic import of `{}`", import.text);
            self.error("import-cycle", import, message);
        } else if self.open.len() >= LONGEST_CHAIN {
            let message = format!("imports are nested more than {LONGEST_CHAIN} levels deep");
            self.error("nested-too-deep", import, message);
        } else if !self.read.contains(&identity) {
            let source = self.sources.add(file.path, file.text);
            self.file(source);
        }
    }

    fn error(&mut self, code: &'static str, at: &Name, message: String) {
        self.found.push(Diagnostic::error(code, at.span, message));
    }
}
