//! The packages that the clause `dependencies` names, which are those of the worker's language.

use crate::{cpp, dependencies, requirements};
use rc_cdsl::Component;
use rc_diagnostics::Diagnostics;
use rc_vocabulary::Language;

/// Checks the clause.
pub(crate) fn check(language: Language, component: &Component, found: &mut Diagnostics) {
    match language {
        Language::Rust => dependencies::check(component, found),
        Language::Python => requirements::check(component, found),
        Language::Cpp => cpp::packages::check(component, found),
    }
}
