//! The names of slots.

use crate::ast::SlotDecl;
use rc_diagnostics::Span;
use std::collections::HashMap;

/// The names of slots. `as` sets the name. Otherwise it is the interface's name, with a number for
/// repetitions, as in RoboComp.
#[derive(Default)]
pub(crate) struct SlotNames {
    /// The locations of used names, by name in lower case.
    pub(crate) taken: HashMap<String, Span>,
    /// The next number to try, by interface in lower case.
    next: HashMap<String, usize>,
}

impl SlotNames {
    /// The name of a slot: as declared, or the interface's name with the first free number.
    pub(crate) fn name(&mut self, decl: &SlotDecl) -> String {
        if let Some(name) = &decl.name {
            return name.text.clone();
        }
        let base = &decl.interface.text;
        let next = self.next.entry(base.to_ascii_lowercase()).or_default();
        loop {
            let name = match *next {
                0 => base.clone(),
                number => format!("{base}{number}"),
            };
            *next += 1;
            if !self.taken.contains_key(&name.to_ascii_lowercase()) {
                return name;
            }
        }
    }
}
