//! The crate `interfaces` of a workspace: one module for each module of the IDSL that its
//! components use, so that a type of two components is one type.
//!
//! It is in `interfaces/generated/` of the workspace, or of the component outside of a workspace.
//! Each generation adds the modules of its components; generating the whole workspace also removes
//! those that no component uses. The manifest of the crate records the definition of each module:
//! its file, and the hash of its text without comments.

mod contents;
mod definition;
mod error;

use crate::cargo_workspace::Workspace;
use crate::files::{Files, GENERATED};
use crate::generate::InterfaceModule;
use crate::load;
use crate::origin::{self, Origin};
use crate::paths;
use contents::Entry;
pub use definition::{Definition, Definitions};
pub use error::Error;
use rc_diagnostics::{Diagnostic, Diagnostics, SourceMap, Span};
use rc_idsl::Session;
use rc_syntax::Loader;
use rustix::fs::{FlockOperation, flock};
use rustix::io::Errno;
use std::collections::BTreeMap;
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// How long a generation waits for others of the same workspace; each takes milliseconds.
const PATIENCE: Duration = Duration::from_secs(30);

/// Where components keep the interfaces that they share.
#[derive(Clone, Debug)]
pub struct InterfaceCrate {
    /// The workspace, or the component's folder.
    root: PathBuf,
    /// The folder with the `.idsl` files of the workspace and `generated/`.
    folder: PathBuf,
    workspace: Option<Workspace>,
}

/// No other generation changes the crate as long as this lives.
#[derive(Debug)]
pub struct Lock {
    _folder: File,
}

impl InterfaceCrate {
    /// The crate that the component in `folder` uses.
    pub fn of(folder: &Path) -> io::Result<Self> {
        Ok(if let Some(workspace) = Workspace::of(folder)? {
            Self::in_workspace(workspace)
        } else {
            let root = paths::absolute(folder)?;
            Self {
                folder: root.join("interfaces"),
                root,
                workspace: None,
            }
        })
    }

    /// The crate of a workspace.
    pub fn in_workspace(workspace: Workspace) -> Self {
        Self {
            root: workspace.root().to_path_buf(),
            folder: workspace.interfaces(),
            workspace: Some(workspace),
        }
    }

    /// The folder that holds the crate in `generated/`, and the user's `.idsl` files.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The folder whose components share it.
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// The workspace; none if a component is in none.
    pub fn workspace(&self) -> Option<&Workspace> {
        self.workspace.as_ref()
    }

    /// The path from the `generated/` of the component in `folder` to the crate, as its manifest
    /// names it.
    pub fn dependency(&self, folder: &Path) -> io::Result<String> {
        let from = paths::absolute(&folder.join(GENERATED))?;
        let path = paths::relative(&from, &self.folder.join(GENERATED));
        Ok(path.to_string_lossy().into_owned())
    }

    /// The path that leads from the folder of a component to another folder.
    pub fn from(&self, component: &Path, to: &Path) -> io::Result<PathBuf> {
        let from = paths::absolute(component)?;
        Ok(paths::relative(&from, to))
    }

    /// Waits until no other generation changes the crate.
    ///
    /// # Errors
    /// Another process holds it for half a minute, or the root cannot be opened.
    pub fn lock(&self) -> io::Result<Lock> {
        std::fs::create_dir_all(&self.root)?;
        // A lock on the folder leaves no file.
        let folder = File::open(&self.root)?;
        let deadline = Instant::now() + PATIENCE;
        loop {
            match flock(&folder, FlockOperation::NonBlockingLockExclusive) {
                Err(Errno::WOULDBLOCK) if Instant::now() < deadline => {
                    std::thread::sleep(Duration::from_millis(5));
                }
                Err(Errno::WOULDBLOCK) => {
                    let message = format!("another program holds {}", self.root.display());
                    return Err(io::Error::new(io::ErrorKind::TimedOut, message));
                }
                // As cargo does on file systems that cannot lock: network file systems lock no
                // folders.
                Err(Errno::BADF | Errno::NOTSUP | Errno::NOSYS | Errno::NOLCK) | Ok(()) => {
                    return Ok(Lock { _folder: folder });
                }
                Err(error) => return Err(error.into()),
            }
        }
    }

    /// The definitions in the `.idsl` files of the folder of interfaces. Files with errors are left
    /// out, with their errors in `found`; the second value says whether there are any.
    pub fn own(
        &self,
        sources: &mut SourceMap,
        loader: &dyn Loader,
        found: &mut Diagnostics,
    ) -> Result<(Vec<Definitions>, bool), Error> {
        let mut all = Vec::new();
        let mut faulty = false;
        let entries = std::fs::read_dir(&self.folder).into_iter().flatten();
        let mut files: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
        files.retain(|path| path.extension().is_some_and(|e| e == "idsl"));
        files.sort();
        for path in files {
            let text = match rc_files::read(&path) {
                Ok(text) => text,
                Err(error) if error.kind() == io::ErrorKind::InvalidData => {
                    found.push(load::not_utf8(&path, &std::fs::read(&path)?, sources));
                    faulty = true;
                    continue;
                }
                Err(error) => return Err(paths::named(&path, &error).into()),
            };
            let source = sources.add(&path, text);
            let mut session = Session::new(sources, loader);
            session.load_source(source, &path);
            let (library, mut more) = (session.library, session.found);
            if !more.has_errors() {
                let origins = Origin::all(&library, sources);
                let (definitions, others) = Definitions::of(&library, &origins)?;
                more.extend(others);
                if !more.has_errors() {
                    all.push(definitions);
                }
            }
            faulty |= more.has_errors();
            found.extend(more);
        }
        Ok((all, faulty))
    }

    /// The definitions, with their files as the crate records them. The folder of interfaces comes
    /// first, so that its comments are printed.
    pub fn definitions(&self, all: Vec<Definitions>) -> Vec<Definition> {
        let all = all.into_iter().flat_map(|definitions| definitions.0);
        let mut all: Vec<Definition> = all
            .map(|(code, origin, span, uses)| Definition {
                code,
                span,
                uses,
                file: self.recorded(&origin.path),
                path: origin.path,
                hash: origin.hash,
            })
            .collect();
        let own = self.recorded(&self.folder);
        all.sort_by_key(|definition| {
            let is_own = Path::new(&definition.file).parent() == Some(Path::new(&own));
            (!is_own, definition.file.clone())
        });
        all
    }

    /// The files of the crate with these modules, relative to [`InterfaceCrate::folder`]; existing
    /// ones stay unless `exact`. None if a module has two definitions, which `found` shows.
    pub fn files(
        &self,
        definitions: Vec<Definition>,
        exact: bool,
        sources: &mut SourceMap,
        loader: &dyn Loader,
        found: &mut Diagnostics,
    ) -> Result<Option<Files>, Error> {
        let mut entries = if exact {
            BTreeMap::new()
        } else {
            contents::read(&self.folder.join(GENERATED))?
        };
        let hashes = entries.iter();
        let hashes: BTreeMap<String, String> = hashes
            .map(|(stem, entry)| (stem.clone(), entry.hash.clone()))
            .collect();
        let mut new: BTreeMap<String, (PathBuf, Span)> = BTreeMap::new();
        let mut conflict = false;
        for definition in definitions {
            let stem = definition.code.stem.clone();
            let other = match (entries.get(&stem), new.get(&stem)) {
                (None, _) => None,
                (Some(entry), place) if definition.is(entry) => {
                    // The first one of this generation is printed; before it, what an older one
                    // printed is renewed.
                    if place.is_some() {
                        continue;
                    }
                    None
                }
                (Some(_), Some(place)) => Some(place.clone()),
                (Some(entry), None) if entry.file == definition.file => None,
                (Some(entry), None) => self.elsewhere(entry, &definition, sources),
            };
            if let Some(other) = other {
                conflict = true;
                let name = entries.get(&stem).map(|entry| &entry.name);
                found.push(match name.filter(|name| **name != definition.code.name) {
                    Some(name) => collision(name, &definition, other.1),
                    None => two_definitions(&definition, &other.0, other.1),
                });
                continue;
            }
            // An equal definition in another file keeps its place as long as it is there.
            let before = entries.get(&stem).filter(|entry| definition.is(entry));
            let before = before.filter(|entry| self.exists(&entry.file));
            let file = before.map_or(definition.file, |entry| entry.file.clone());
            new.insert(stem.clone(), (definition.path, definition.span));
            let entry = Entry {
                name: definition.code.name,
                file,
                hash: definition.hash,
                uses: definition.uses,
                text: Some(definition.code.text),
            };
            entries.insert(stem, entry);
        }
        if conflict {
            return Ok(None);
        }
        let changed = new.keys().filter(|stem| {
            let now = entries.get(*stem).map(|entry| &entry.hash);
            hashes.get(*stem) != now
        });
        let changed: Vec<&String> = changed.collect();
        let stale = entries.iter().filter(|(stem, entry)| {
            !new.contains_key(*stem) && entry.uses.iter().any(|used| changed.contains(&used))
        });
        let stale: Vec<String> = stale.map(|(stem, _)| stem.clone()).collect();
        for stem in stale {
            self.renew(&stem, &mut entries, sources, loader)?;
        }
        contents::print(&entries).map(Some)
    }

    /// Prints a module of the crate again, after the definition of a module that it imports
    /// changed: its code contains the hashes of their types.
    ///
    /// # Errors
    /// Its file was deleted or has errors, or it imports another definition than the crate has.
    fn renew(
        &self,
        stem: &str,
        entries: &mut BTreeMap<String, Entry>,
        sources: &mut SourceMap,
        loader: &dyn Loader,
    ) -> Result<(), Error> {
        let Some(entry) = entries.get(stem) else {
            return Ok(());
        };
        let definitions = self.load(&entry.file, sources, loader)?;
        let same = definitions.iter().all(|definition| {
            let other = entries.get(&definition.code.stem);
            definition.code.stem == stem || other.is_some_and(|entry| definition.is(entry))
        });
        let definition = definitions.into_iter().find(|d| d.code.stem == stem);
        let Some(definition) = definition.filter(|_| same) else {
            let message = format!(
                "a module that `{}` imports changed, and rcgen cannot print it again from {}; \
                 generate the whole workspace: rcgen .",
                entry.name, entry.file
            );
            return Err(io::Error::new(io::ErrorKind::InvalidInput, message).into());
        };
        let entry = Entry {
            name: definition.code.name,
            file: entry.file.clone(),
            hash: definition.hash,
            uses: definition.uses,
            text: Some(definition.code.text),
        };
        entries.insert(stem.to_owned(), entry);
        Ok(())
    }

    /// The definitions that a recorded file reaches; none if it was deleted or has errors.
    fn load(
        &self,
        file: &str,
        sources: &mut SourceMap,
        loader: &dyn Loader,
    ) -> Result<Vec<Definition>, Error> {
        let (path, text) = match load::shipped(Path::new(file)) {
            Some(text) => (PathBuf::from(file), Some(text.to_owned())),
            None => (
                self.root.join(file),
                rc_files::read(&self.root.join(file)).ok(),
            ),
        };
        let Some(text) = text else {
            return Ok(Vec::new());
        };
        let source = sources.add(&path, text);
        let mut session = Session::new(sources, loader);
        session.load_source(source, &path);
        let (library, found) = (session.library, session.found);
        if found.has_errors() {
            return Ok(Vec::new());
        }
        let origins = Origin::all(&library, sources);
        let (definitions, found) = Definitions::of(&library, &origins)?;
        if found.has_errors() {
            return Ok(Vec::new());
        }
        Ok(self.definitions(vec![definitions]))
    }

    /// The workspace's manifest with the entries that the crate needs, and without `no_packages`,
    /// folders that cargo must not consider packages, if something is missing.
    ///
    /// # Errors
    /// The manifest cannot be read.
    pub fn manifest(&self, no_packages: &[&Path]) -> io::Result<Option<Files>> {
        let Some(workspace) = &self.workspace else {
            return Ok(None);
        };
        Ok(workspace.as_needed(no_packages)?.map(|(old, new)| {
            let mut files = Files::default();
            files.edit("Cargo.toml", old, new);
            files
        }))
    }

    /// The place of another definition of the same module that the crate has, if it still exists.
    fn elsewhere(
        &self,
        entry: &Entry,
        definition: &Definition,
        sources: &mut SourceMap,
    ) -> Option<(PathBuf, Span)> {
        let own = self.recorded(&self.folder);
        let is_shipped = |file: &str| file.starts_with("<shipped>/");
        // A file of the workspace's folder hides the one that comes with rcgen, for all components.
        if is_shipped(&entry.file) && Path::new(&definition.file).parent() == Some(Path::new(&own))
        {
            return None;
        }
        let (path, text) = if let Some(text) = load::shipped(Path::new(&entry.file)) {
            (PathBuf::from(&entry.file), text.to_owned())
        } else {
            let path = self.root.join(&entry.file);
            let text = rc_files::read(&path).ok()?;
            (path, text)
        };
        if origin::hash(&text) == definition.hash {
            return None;
        }
        let source = sources.add(path.clone(), text);
        let parsed = sources.cached(source, rc_idsl::parse);
        let module = parsed.0.module.as_ref()?;
        (module.name.text == entry.name).then_some((path, module.name.span))
    }

    fn exists(&self, file: &str) -> bool {
        load::shipped(Path::new(file)).is_some() || self.root.join(file).exists()
    }

    /// A path as the crate records it: from the root.
    fn recorded(&self, path: &Path) -> String {
        if load::shipped(path).is_some() {
            return path.to_string_lossy().into_owned();
        }
        let real = path.canonicalize().unwrap_or_else(|_| path.to_path_buf());
        let path = paths::relative(&self.root, &real);
        path.to_string_lossy().into_owned()
    }
}

/// A crate without modules, for a new workspace.
pub fn empty() -> Result<Files, Error> {
    contents::print(&BTreeMap::new())
}

/// Two modules whose names differ, but not in Rust.
fn collision(first: &str, definition: &Definition, other: Span) -> Diagnostic {
    let InterfaceModule { name, stem, .. } = &definition.code;
    let message = format!("modules `{first}` and `{name}` are both `{stem}` in Rust");
    Diagnostic::error("name-collision", definition.span, message).label(other, "the other one")
}

fn two_definitions(definition: &Definition, path: &Path, other: Span) -> Diagnostic {
    let name = &definition.code.name;
    let message = format!(
        "the workspace has two definitions of module `{name}`: {} and {}",
        path.display(),
        definition.path.display()
    );
    Diagnostic::error("two-definitions", definition.span, message)
        .label(other, "the other definition")
        .help("components of a workspace share their types: let both import one file, or rename one of the modules")
}
