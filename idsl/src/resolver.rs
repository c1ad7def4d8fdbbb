//! The state of resolving one module.

use crate::model::{Library, ModuleId};
use rc_diagnostics::{Diagnostic, Diagnostics};

/// Resolves the declarations of one module into the library.
pub(crate) struct ModuleResolver<'s> {
    pub(crate) library: &'s mut Library,
    pub(crate) found: &'s mut Diagnostics,
    /// The number of unknown names for which a similar name was searched.
    pub(crate) suggestions: &'s mut usize,
    /// Whether an import failed, so that names may be unknown for this reason.
    pub(crate) import_failed: bool,
    pub(crate) module: ModuleId,
}

impl ModuleResolver<'_> {
    pub(crate) fn report(&mut self, diagnostic: Diagnostic) {
        self.found.push(diagnostic);
    }
}
