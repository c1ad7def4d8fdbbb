//! The definitions of IDSL modules, as components and the folder of interfaces give them.

use super::contents::Entry;
use crate::generate::{self, InterfaceModule};
use crate::names;
use crate::origin::Origin;
use crate::templates::TemplateError;
use rc_diagnostics::{Diagnostics, Span};
use rc_idsl::Library;
use rc_idsl::model::ModuleId;
use std::path::PathBuf;

/// A module as one component, or the folder of interfaces, defines it.
#[derive(Clone, Debug)]
pub struct Definition {
    pub(super) code: InterfaceModule,
    /// The place of its name.
    pub(super) span: Span,
    pub(super) path: PathBuf,
    /// File, from the root; `<shipped>/NAME.idsl` comes with rcgen.
    pub(super) file: String,
    pub(super) hash: String,
    pub(super) uses: Vec<String>,
}

/// The definitions of the modules of a library.
#[derive(Clone, Debug, Default)]
pub struct Definitions(pub(super) Vec<(InterfaceModule, Origin, Span, Vec<String>)>);

impl Definitions {
    /// Prints the modules of a library that has no errors; `origins` are their files.
    pub fn of(library: &Library, origins: &[Origin]) -> Result<(Self, Diagnostics), TemplateError> {
        let (modules, found) = generate::interfaces(library)?;
        let definitions = modules.into_iter().filter_map(|code| {
            let mut declared = library.modules.iter().zip(origins);
            let (module, origin) = declared.find(|(module, _)| module.name.text == code.name)?;
            let id = library
                .modules
                .iter()
                .position(|m| std::ptr::eq(m, module))?;
            let uses = library.reachable(ModuleId(id)).into_iter();
            let uses = uses.map(|id| names::module(&library.modules[id.0].name.text));
            let mut uses: Vec<String> = uses.filter(|stem| *stem != code.stem).collect();
            uses.sort();
            Some((code, origin.clone(), module.span(), uses))
        });
        Ok((Self(definitions.collect()), found))
    }
}

impl Definition {
    /// Whether the crate holds this definition.
    pub(super) fn is(&self, entry: &Entry) -> bool {
        self.hash == entry.hash && self.code.name == entry.name
    }
}
