//! Generates components whose generated code is missing or of an older model, before they are
//! built.

use crate::error::{Error, refused};
use crate::programs::Programs;
use rc_cdsl::model::Middleware;
use rc_codegen::generation::{self, Component};
use rc_codegen::interface_crate::{self, InterfaceCrate};
use rc_codegen::note::Note;
use rc_codegen::{FileLoader, Project, stubs};
use rc_diagnostics::{Diagnostics, SourceMap};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Result of a generation.
#[derive(Debug, Default)]
pub struct Generated {
    /// The `.cdsl` files of the components.
    pub components: Vec<PathBuf>,
    /// Mistakes in components, and functions that their workers lack now.
    pub found: Diagnostics,
}

/// The components of one workspace, which share a crate of interfaces.
struct Shared<'n> {
    interfaces: InterfaceCrate,
    stale: Vec<(&'n Project, Middleware)>,
}

impl Programs {
    /// Generates the components that `up --build` builds from their folders, if that is necessary.
    /// Nothing of a workspace is written if one of its components has errors.
    pub fn generate_stale(
        &self,
        sources: &mut SourceMap,
        loader: &FileLoader,
    ) -> Result<Generated, Error> {
        let mut workspaces: BTreeMap<PathBuf, Shared<'_>> = BTreeMap::new();
        for (project, middleware) in self.stale() {
            let interfaces =
                InterfaceCrate::of(project.code()).map_err(refused(action(project)))?;
            let root = interfaces.root().to_path_buf();
            let shared = workspaces.entry(root).or_insert_with(|| Shared {
                interfaces,
                stale: Vec::new(),
            });
            shared.stale.push((project, middleware));
        }
        let mut done = Generated::default();
        for shared in workspaces.into_values() {
            shared.generate(sources, loader, &mut done)?;
        }
        Ok(done)
    }

    /// The components to generate, each with its middleware.
    fn stale(&self) -> Vec<(&Project, Middleware)> {
        let mut stale: Vec<(&Project, Middleware)> = Vec::new();
        for built in self.built() {
            let (instance, project, variant) = (built.instance, built.project, built.variant);
            let note = Note::of_generated(project.code());
            let middleware = match (&note, variant) {
                // A folder with code of an older model, or with code that does not tell.
                (Ok(Some(note)), None) if note.model == format!("{:016x}", project.hash) => {
                    continue;
                }
                (Ok(Some(note)), None) => {
                    let known = Middleware::from_word(&note.middleware);
                    known.unwrap_or(instance.middleware)
                }
                (Ok(None) | Err(_), None) => instance.middleware,
                // A variant needs the folder's own manifest and worker, not its generated code.
                (_, Some(_)) if project.code().join(project.manifest()).exists() => {
                    continue;
                }
                (_, Some(_)) => Middleware::DEFAULT,
            };
            if stale.iter().all(|(known, _)| known.path != project.path) {
                stale.push((project, middleware));
            }
        }
        stale
    }
}

impl Shared<'_> {
    fn generate(
        self,
        sources: &mut SourceMap,
        loader: &FileLoader,
        done: &mut Generated,
    ) -> Result<(), Error> {
        let mut components = Vec::new();
        for (project, middleware) in &self.stale {
            let folder = project.code().to_path_buf();
            let (component, found) = Component::of(project, folder, *middleware, &self.interfaces)
                .map_err(failed(project))?;
            done.found.extend(found);
            components.extend(component);
        }
        let Some((first, _)) = self.stale.first().filter(|_| !done.found.has_errors()) else {
            return Ok(());
        };
        {
            let _lock = self.interfaces.lock().map_err(refused(action(first)))?;
            let parts = generation::parts(
                &self.interfaces,
                &components,
                Vec::new(),
                self.interfaces.workspace().is_none(),
                sources,
                loader,
                &mut done.found,
            );
            let Some(parts) = parts.map_err(failed(first))? else {
                return Ok(());
            };
            generation::write(&parts).map_err(refused(action(first)))?;
        }
        for (project, _) in &self.stale {
            // The compiler reports the mistakes of a worker that cannot be parsed; one in Python
            // is checked when it starts.
            if project.is_built_by_cargo()
                && let Ok((Some(missing), found)) = stubs::of(project, project.code(), sources)
            {
                done.found.extend(found);
                done.found.extend(missing.notes(project));
            }
            done.components.push(project.path.clone());
        }
        Ok(())
    }
}

fn action(project: &Project) -> String {
    format!("generate {}", project.path.display())
}

/// A failed generation as an error about a component.
fn failed(project: &Project) -> impl FnOnce(interface_crate::Error) -> Error {
    let action = action(project);
    move |error| match error {
        interface_crate::Error::Io(error) => refused(action)(error),
        interface_crate::Error::Template(error) => {
            Error::Workspace(format!("cannot {action}: {error}"))
        }
    }
}
