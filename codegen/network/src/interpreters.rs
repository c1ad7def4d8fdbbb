//! The interpreters of components in Python: launchers would fail on those that are missing, too old
//! or without `NumPy`, and on an extension module that is nowhere.

use crate::launcher;
use crate::plan::Environment;
use crate::profile::Profile;
use crate::programs::Programs;
use crate::workspaces::Workspaces;
use rc_codegen::python::component_interpreter::{self, InPath};
use rc_diagnostics::{Diagnostic, Diagnostics};
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
        for built in self.built() {
            let (instance, project) = (built.instance, built.project);
            let is_python = project.language().is_some_and(Language::has_interpreter);
            let is_copied = || Environment::of(project.code()).is_some();
            let is_here = self.is_here(instance);
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
        self.check_trees(found);
    }

    /// Reports components with a tree where the framework has no folder: `up --build` builds no
    /// extension module there, and a wheel has none for trees.
    fn check_trees(&self, found: &mut Diagnostics) {
        let mut seen: HashSet<&Path> = HashSet::new();
        for built in self.built() {
            let (instance, project) = (built.instance, built.project);
            let is_python = project.language() == Some(Language::Python);
            if !is_python || !launcher::has_tree(project) || !seen.insert(&project.path) {
                continue;
            }
            // A manifest that cannot be read is reported where it is needed.
            let Ok(Some(root)) = Workspaces::root(project.code()) else {
                continue;
            };
            if matches!(launcher::framework(&root), Ok(None)) {
                let place = instance.cdsl.as_ref().unwrap_or(&instance.name).span;
                let message = format!(
                    "`{}` has a tree, for which a wheel of the framework has no extension module",
                    project.component.name.text
                );
                let manifest = root.join("Cargo.toml");
                let help = format!("name the framework by a path in `{}`", manifest.display());
                found.push(Diagnostic::warning("no-tree-module", place, message).help(help));
            }
        }
    }
}
