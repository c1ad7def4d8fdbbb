//! The state of resolving one component.

use rc_diagnostics::{Diagnostic, Diagnostics, Span};
use rc_idsl::model::{InterfaceId, Library, ModuleId};
use rc_syntax::Name;
use std::collections::{HashMap, HashSet};

/// Resolves a component against the imported interfaces.
pub(crate) struct Resolver<'a> {
    pub(crate) interfaces: HashMap<String, Vec<InterfaceId>>,
    pub(crate) library: Library,
    pub(crate) imports: Vec<(ModuleId, Span)>,
    /// The file names of the imports that failed, without extensions.
    pub(crate) failed_imports: Vec<String>,
    /// The file names of all imports, without extensions.
    pub(crate) imported: HashSet<String>,
    /// Whether an import of this name would succeed.
    pub(crate) import_exists: &'a dyn Fn(&str) -> bool,
    pub(crate) import_lookups: usize,
    /// Where an import of this file is added, and its text.
    pub(crate) import_edit: &'a dyn Fn(&str) -> (Span, String),
    pub(crate) found: &'a mut Diagnostics,
}

impl Resolver<'_> {
    /// Reports a keyword that occurs a second time.
    pub(crate) fn check_unique(
        &mut self,
        seen: &mut HashMap<String, Span>,
        word: &Name,
        what: &str,
    ) {
        if let Some(first) = seen.insert(word.text.to_lowercase(), word.span) {
            let message = format!("duplicate {what} `{}`", word.text);
            self.found.push(
                Diagnostic::error("repeated-clause", word.span, message)
                    .label(first, "first used here"),
            );
        }
    }
}
