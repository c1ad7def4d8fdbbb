//! Reads the components of a network, one after another: an editor that waits may go first.

use crate::load::{Components, check};
use crate::{Network, Overrides};
use rc_codegen::installed::{self, named_component};
use rc_codegen::{FileLoader, Project};
use rc_ddsl::model::Deployment;
use rc_diagnostics::{Diagnostic, Diagnostics, SourceMap};
use rc_syntax::Name;
use std::collections::HashMap;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::rc::Rc;

/// A network whose components are being read.
#[derive(Debug)]
pub struct Reading {
    path: PathBuf,
    deployment: Deployment,
    /// The components that were read: those of the instances, then those of the external slots whose
    /// peer is described.
    projects: Vec<Option<Rc<Project>>>,
    /// The component of each file with the files that were read for it. It is read and reported once.
    known: HashMap<PathBuf, (Option<Rc<Project>>, Vec<PathBuf>)>,
    /// For each source file, the instances of the components that it belongs to.
    texts: HashMap<PathBuf, Vec<usize>>,
    found: Diagnostics,
}

impl Reading {
    /// The network of a `.ddsl` of which no component is read yet.
    pub fn new(path: &Path, deployment: Deployment) -> Self {
        Self {
            path: path.to_path_buf(),
            deployment,
            projects: Vec::new(),
            known: HashMap::new(),
            texts: HashMap::new(),
            found: Diagnostics::new(),
        }
    }

    /// Reads the component of the next instance, or of the next external slot. Returns whether there
    /// was one.
    pub fn read_next(&mut self, sources: &mut SourceMap, loader: &FileLoader) -> bool {
        let at = self.projects.len();
        let instances = &self.deployment.instances;
        let (belongs_to, described) = if let Some(instance) = instances.get(at) {
            let named = instance.cdsl.as_ref();
            (Some(at), named.map(|named| (&instance.folder, named)))
        } else {
            let Some(external) = self.deployment.externals.get(at - instances.len()) else {
                return false;
            };
            let peer = external.peer.as_ref();
            (None, peer.map(|peer| (&peer.folder, &peer.cdsl)))
        };
        let project = described.map(|(folder, named)| (folder.clone(), named.clone()));
        let project = project
            .and_then(|(folder, named)| self.read(&folder, &named, belongs_to, sources, loader));
        self.projects.push(project);
        true
    }

    /// The component of a file, which belongs to an instance.
    fn read(
        &mut self,
        folder: &Path,
        named: &Name,
        instance: Option<usize>,
        sources: &mut SourceMap,
        loader: &FileLoader,
    ) -> Option<Rc<Project>> {
        let path = named_component(folder, &named.text);
        if !self.known.contains_key(&path) {
            let first = sources.ids().count();
            let project = match Project::load(&path, sources, loader) {
                Ok((project, more)) => {
                    let project = project.filter(|_| !more.has_errors()).map(Rc::new);
                    self.found.extend(more);
                    project
                }
                Err(error) => {
                    self.found.push(not_found(folder, named, &error));
                    None
                }
            };
            let read = sources.ids().skip(first);
            let read = read.map(|id| sources.path(id).into()).collect();
            self.known.insert(path.clone(), (project, read));
        }
        let (project, read) = self.known.get(&path)?;
        for (file, at) in read.iter().zip(instance.into_iter().cycle()) {
            self.texts.entry(file.clone()).or_default().push(at);
        }
        project.clone()
    }

    /// Checks the network, all of whose components were read. Executables are not checked, and
    /// findings of the text of the `.ddsl` alone are not repeated.
    pub fn check(
        mut self,
        overrides: &Overrides<'_>,
        sources: &mut SourceMap,
        loader: &FileLoader,
    ) -> (Network, Diagnostics) {
        let peers = self.projects.split_off(self.deployment.instances.len());
        let components = Components {
            projects: self.projects,
            peers,
            texts: self.texts,
        };
        let network = check(
            &self.path,
            self.deployment,
            components,
            overrides,
            (sources, loader),
            &mut self.found,
        );
        (network, self.found)
    }
}

/// The error for a component that cannot be read.
fn not_found(folder: &Path, named: &Name, error: &std::io::Error) -> Diagnostic {
    let is_relative = Path::new(&named.text).is_relative();
    let near = is_relative
        .then(|| inside(folder, &named.text).or_else(|| nearest_file(folder, &named.text)));
    let near = near.flatten();
    let reason = match &near {
        Some(_) if error.kind() == ErrorKind::NotFound => "No such file or directory".to_owned(),
        Some(_) if folder.join(&named.text).is_dir() => "it is a folder".to_owned(),
        _ => error.to_string(),
    };
    let message = format!("`{}` cannot be read: {reason}", named.text);
    let error = Diagnostic::error("component-not-found", named.span, message);
    match near {
        Some(near) => error.did_you_mean(&named.text, Some(&near)),
        None if is_relative => error.help(format!(
            "the path is relative to this file; neither the workspace nor {} has a component of this name",
            installed::prefix().display()
        )),
        None => error,
    }
}

/// The component of the folder that `wanted` names: `NAME/NAME.cdsl`.
fn inside(folder: &Path, wanted: &str) -> Option<String> {
    let name = Path::new(wanted).file_name()?;
    let file = Path::new(wanted).join(name).with_extension("cdsl");
    let found = folder.join(&file).is_file();
    found.then(|| file.to_str().map(str::to_owned)).flatten()
}

/// The path of the component near `folder` that `wanted` most likely means: with the same file
/// name, or with a similar path.
fn nearest_file(folder: &Path, wanted: &str) -> Option<String> {
    let mut left = MAX_ENTRIES;
    let (mut known, mut beside) = (Vec::new(), Vec::new());
    components_in(folder, Path::new(""), 0, &mut left, &mut known);
    components_in(
        &folder.join(".."),
        Path::new(".."),
        0,
        &mut left,
        &mut beside,
    );
    known.sort();
    beside.sort();
    // Shorter paths come first.
    known.extend(beside);
    let name = |path: &str| Path::new(path).file_name().map(ToOwned::to_owned);
    let same = known.iter().find(|path| name(path) == name(wanted));
    let near = || rc_diagnostics::nearest(wanted, known.iter().map(String::as_str));
    same.map(String::as_str).or_else(near).map(str::to_owned)
}

/// How many entries of folders are looked at for a suggestion, and how deep.
const MAX_ENTRIES: usize = 2000;
const MAX_DEPTH: usize = 3;

/// Adds the components below a folder, each with its path below `shown`.
fn components_in(
    folder: &Path,
    shown: &Path,
    depth: usize,
    left: &mut usize,
    known: &mut Vec<String>,
) {
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        if *left == 0 {
            return;
        }
        *left -= 1;
        let name = entry.file_name();
        let path = shown.join(&name);
        let is_folder = entry.file_type().is_ok_and(|kind| kind.is_dir());
        let is_left_out = ["target", "generated", "node_modules"]
            .iter()
            .any(|n| name == *n)
            || name.as_encoded_bytes().starts_with(b".");
        if is_folder && !is_left_out && depth < MAX_DEPTH {
            components_in(&entry.path(), &path, depth + 1, left, known);
        } else if path.extension().is_some_and(|e| e == "cdsl") {
            known.extend(path.to_str().map(str::to_owned));
        }
    }
}
