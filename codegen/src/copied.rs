//! Components that were copied with their names.

use crate::Project;
use crate::cargo_workspace::{Package, Workspace};
use crate::names;
use crate::paths::absolute;
use rc_diagnostics::{Diagnostic, Diagnostics};
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::io;
use std::path::{Path, PathBuf};

/// The advice about a copy.
pub const HELP: &str = "give the copy a name of its own: in its .cdsl, in `name` of its Cargo.toml, and in \
                        the paths `NAME_generated` of its src/; or start with `rcgen new NAME --from FILE.cdsl`";

const TWICE: &str = "is in two folders of the workspace";

/// The packages of the members of workspaces with their folders, each read once.
#[derive(Debug, Default)]
pub struct Packages(BTreeMap<PathBuf, Vec<(PathBuf, Package)>>);

impl Packages {
    /// Another folder of the component's workspace whose package has its name, seen from the root.
    /// Cargo refuses such a workspace.
    ///
    /// # Errors
    /// A manifest of the workspace cannot be read.
    pub fn twin(&mut self, project: &Project) -> io::Result<Option<PathBuf>> {
        if !project.is_built_by_cargo() {
            return Ok(None);
        }
        let Some(workspace) = Workspace::of(project.code())? else {
            return Ok(None);
        };
        let root = workspace.root();
        let members = match self.0.entry(root.to_path_buf()) {
            Entry::Occupied(known) => known.into_mut(),
            Entry::Vacant(new) => new.insert(workspace.members()?),
        };
        let name = names::package(&project.component.name.text);
        let folders = members
            .iter()
            .filter(|(_, package)| package.is_named(&name));
        let folders: Vec<&PathBuf> = folders.map(|(folder, _)| folder).collect();
        let own = absolute(project.code())?;
        if !folders.contains(&&own) {
            return Ok(None);
        }
        let other = folders.into_iter().find(|folder| **folder != own);
        Ok(other.map(|folder| folder.strip_prefix(root).unwrap_or(folder).to_path_buf()))
    }
}

/// Reports components of a workspace with one name, also where only one of them was read. Most
/// likely, a folder was copied.
///
/// # Errors
/// A manifest of a workspace cannot be read.
pub fn check(projects: &[&Project], found: &mut Diagnostics) -> io::Result<()> {
    let mut packages = Packages::default();
    let mut named: BTreeMap<(PathBuf, String), Vec<(PathBuf, &Project)>> = BTreeMap::new();
    for project in projects
        .iter()
        .filter(|project| project.is_built_by_cargo())
    {
        let folder = absolute(project.code())?;
        // Descriptions that are not built may have any name.
        let workspace = Workspace::of(&folder)?.filter(|workspace| workspace.lists(&folder));
        if let Some(workspace) = workspace {
            let package = names::package(&project.component.name.text);
            let key = (workspace.root().to_path_buf(), package);
            // Two descriptions of one folder are not copies.
            let same = named.entry(key).or_default();
            if same.iter().all(|(known, _)| *known != folder) {
                same.push((folder, project));
            }
        }
    }
    for same in named.values() {
        let Some(((_, first), copies)) = same.split_first() else {
            continue;
        };
        let name = &first.component.name;
        for (_, copy) in copies {
            let message = format!("component `{}` {TWICE}", name.text);
            let span = copy.component.name.span;
            let error = Diagnostic::error("copied-component", span, message);
            found.push(error.label(name.span, "first declared here").help(HELP));
        }
        if copies.is_empty()
            && let Some(twin) = packages.twin(first)?
        {
            let message = message(first, &twin);
            found.push(Diagnostic::error("copied-component", name.span, message).help(HELP));
        }
    }
    Ok(())
}

/// The finding that a component has a twin in another folder of its workspace.
pub fn message(project: &Project, twin: &Path) -> String {
    let (name, twin) = (&project.component.name.text, twin.display());
    format!("component `{name}` {TWICE}, also in `{twin}`")
}
