//! The interpreters of components in Python: launchers would fail on those that are missing, too old
//! or without `NumPy`.

use crate::plan::Environment;
use crate::profile::Profile;
use crate::programs::Programs;
use rc_codegen::python::component_interpreter::{self, InPath};
use rc_diagnostics::Diagnostics;
use rc_vocabulary::Language;
use std::collections::HashSet;
use std::path::Path;

pub use rc_codegen::python::component_interpreter::Next;

impl Programs {
    /// Checks all that starts a component: its executable, and for one in Python the interpreter.
    pub fn check_programs(&self, profile: Profile, found: &mut Diagnostics) {
        self.check_executables(profile, found);
        self.check_interpreters(Next::Starts, found);
    }

    /// Checks the interpreters of components. Another machine has copies of the environments of
    /// components, and otherwise interpreters of its own.
    pub fn check_interpreters(&self, next: Next, found: &mut Diagnostics) {
        let mut in_path = InPath::default();
        let mut seen: HashSet<&Path> = HashSet::new();
        for (instance, project, is_installed) in self.described() {
            let is_python = project.language().is_some_and(Language::has_interpreter);
            let is_copied = || Environment::of(project.code()).is_some();
            let is_here = self.is_here(instance);
            if is_python && (is_here || is_copied()) && seen.insert(&project.path) {
                let place = instance.cdsl.as_ref().unwrap_or(&instance.name).span;
                // Nothing is built for an installed component.
                let next = if is_installed { Next::Starts } else { next };
                found.extend(component_interpreter::check(
                    project,
                    place,
                    next,
                    &mut in_path,
                ));
            }
        }
    }
}
