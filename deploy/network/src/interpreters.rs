//! The interpreters of components in Python: launchers would fail on those that are missing, too old
//! or without `NumPy`.

use crate::model::{Network, Profile};
use crate::plan::Environment;
use rc_codegen::python::component_interpreter::{self, InPath};
use rc_diagnostics::Diagnostics;
use rc_vocabulary::Language;
use std::collections::HashSet;
use std::path::Path;

pub use rc_codegen::python::component_interpreter::Next;

impl Network {
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
        for (at, project, _) in self.built() {
            let instance = &self.deployment.instances[at];
            let is_python = project.language().is_some_and(Language::has_interpreter);
            let is_copied = || Environment::of(project.code()).is_some();
            let is_here = self.deployment.remote_host(instance).is_none();
            if is_python && (is_here || is_copied()) && seen.insert(&project.path) {
                let place = instance.cdsl.as_ref().unwrap_or(&instance.name).span;
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
