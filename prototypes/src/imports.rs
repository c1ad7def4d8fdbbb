//! Loads a file with all its imports.

use crate::ast::{File, ItemKind};
use crate::parse::parse;
use rc_diagnostics::{Diagnostic, SourceId};
use rc_idsl::Session;
use rc_syntax::Name;
use std::collections::HashSet;
use std::path::{Path, PathBuf};

/// The longest chain of imports. The loader is recursive.
const LONGEST_CHAIN: usize = 64;

/// The files that a file imports, and itself as the last one.
pub(crate) struct Imports<'a> {
    /// The imported interfaces.
    pub(crate) session: Session<'a>,
    pub(crate) files: Vec<File>,
    read: HashSet<PathBuf>,
    open: Vec<PathBuf>,
}

impl<'a> Imports<'a> {
    pub(crate) fn new(session: Session<'a>) -> Self {
        Self {
            session,
            files: Vec::new(),
            read: HashSet::new(),
            open: Vec::new(),
        }
    }

    /// Reads a file that no import names, unless it was read.
    pub(crate) fn root(&mut self, source: SourceId) {
        let path = self.session.sources.path(source);
        if !self.read.contains(&self.session.loader.identity(path)) {
            self.file(source);
        }
    }

    fn file(&mut self, source: SourceId) {
        let path = self.session.sources.path(source).to_path_buf();
        let (file, found) = parse(self.session.sources, source);
        self.session.found.extend(found);
        let identity = self.session.loader.identity(&path);
        self.read.insert(identity.clone());
        self.open.push(identity);
        for item in &file.items {
            if let ItemKind::Import(wanted) = &item.kind {
                self.import(&path, wanted);
            }
        }
        self.open.pop();
        self.files.push(file);
    }

    /// Reads the file that another one imports.
    pub(crate) fn import(&mut self, from: &Path, wanted: &Name) {
        let ending = Path::new(&wanted.text).extension();
        if ending.is_some_and(|ending| ending == "idsl") {
            self.session.import(from, &wanted.text, wanted.span);
            return;
        }
        let file = match self.session.loader.find(from, &wanted.text, "dproto") {
            Ok(file) => file,
            Err(missing) => {
                let missing = missing.diagnostic(&wanted.text, "dproto", wanted.span);
                self.session.found.push(missing);
                return;
            }
        };
        let identity = self.session.loader.identity(&file.path);
        if self.open.contains(&identity) {
            let message = format!("cyclic import of `{}`", wanted.text);
            self.error("import-cycle", wanted, message);
        } else if self.open.len() >= LONGEST_CHAIN {
            let message = format!("imports are nested more than {LONGEST_CHAIN} levels deep");
            self.error("nested-too-deep", wanted, message);
        } else if !self.read.contains(&identity) {
            let source = self.session.sources.add(file.path, file.text);
            self.file(source);
        }
    }

    fn error(&mut self, code: &'static str, at: &Name, message: String) {
        self.session
            .found
            .push(Diagnostic::error(code, at.span, message));
    }
}
