//! An index of components and interfaces: who offers and needs what, and what has changed.

use rc_codegen::{FileLoader, Project, parallel, source_files};
use rc_diagnostics::foreign::clean;
use rc_diagnostics::{Diagnostics, Format, SourceMap, render};
use rc_idsl::Session;
use rc_idsl::canonical::interface_hash;
use rc_idsl::model::{InterfaceId, Library};
use rc_syntax::Loader;
use rc_vocabulary::Role;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::path::{Path, PathBuf};

/// The components and interfaces of some folders.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Index {
    /// The components, by their files.
    pub components: Vec<IndexedComponent>,
    /// The interfaces that they use and that the folders hold, by name.
    pub interfaces: Vec<IndexedInterface>,
    /// Findings about files, one in each text.
    pub faults: Vec<String>,
}

/// A component.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct IndexedComponent {
    /// Its name.
    pub name: String,
    /// Its `.cdsl`.
    pub file: PathBuf,
    /// The lines of its documentation.
    #[serde(default)]
    pub doc: Vec<String>,
    /// The language of its worker.
    pub language: String,
    /// The licence, as the manifest of its package or of its workspace names it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub licence: Option<String>,
    /// Its slots.
    pub slots: Vec<IndexedSlot>,
    /// Whether its file, or one that it needs, has an error.
    pub broken: bool,
}

/// A slot of a component.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct IndexedSlot {
    /// Its name.
    pub name: String,
    /// `implements`, `requires`, `publishes` or `subscribesTo`.
    pub role: String,
    /// The interface: `Module::Name`.
    pub interface: String,
}

/// An interface.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct IndexedInterface {
    /// `Module::Name`.
    pub name: String,
    /// The hash of its operations and types: ends with equal hashes understand each other. Several,
    /// if components use different definitions.
    pub hashes: Vec<String>,
    /// The components with a slot of it, by role.
    pub users: BTreeMap<String, Vec<String>>,
}

/// A difference between two states.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Change {
    /// Description of the change.
    pub text: String,
    /// Whether what worked with the earlier state may fail with this one: something is gone, or its
    /// messages are others.
    pub breaks: bool,
}

/// Declarations of one file.
#[derive(Default)]
struct Read {
    component: Option<IndexedComponent>,
    interfaces: Vec<(String, String)>,
    faults: Vec<String>,
}

impl Index {
    /// Reads the components and interfaces of files and folders. `include`: further folders of
    /// interfaces.
    ///
    /// # Errors
    /// A path does not exist, or a folder cannot be read. A file that cannot is a fault.
    pub fn of(paths: &[PathBuf], include: &[PathBuf]) -> io::Result<Self> {
        for path in paths {
            path.metadata()
                .map_err(|e| io::Error::new(e.kind(), format!("{}: {e}", path.display())))?;
        }
        let is_wanted = |path: &Path| path.extension().is_some_and(|e| e == "cdsl" || e == "idsl");
        let mut files = source_files::files(paths, &is_wanted)?;
        files.sort();
        files.dedup();
        let read = parallel::map(&mut files, |file| {
            let loader = FileLoader::new(include);
            match file.extension().and_then(|ending| ending.to_str()) {
                Some("cdsl") => component(file, &loader),
                _ => interfaces(file, &loader),
            }
        });
        let mut index = Self::default();
        let mut known: BTreeMap<String, IndexedInterface> = BTreeMap::new();
        for one in read {
            for (name, hash) in one.interfaces {
                let interface = known.entry(name.clone()).or_default();
                interface.name = name;
                if !interface.hashes.contains(&hash) {
                    interface.hashes.push(hash);
                }
            }
            for fault in one.faults {
                if !index.faults.contains(&fault) {
                    index.faults.push(fault);
                }
            }
            index.components.extend(one.component);
        }
        for component in &index.components {
            for slot in &component.slots {
                let interface = known.entry(slot.interface.clone()).or_default();
                interface.name.clone_from(&slot.interface);
                let users = interface.users.entry(slot.role.clone()).or_default();
                if !users.contains(&component.name) {
                    users.push(component.name.clone());
                }
            }
        }
        index.interfaces = known.into_values().collect();
        // A file that was moved changes nothing.
        for interface in &mut index.interfaces {
            interface.hashes.sort();
        }
        Ok(index)
    }

    /// Changes since an earlier index: components by name, interfaces by name.
    pub fn changes(&self, before: &Self) -> Vec<Change> {
        let mut changes = Vec::new();
        let mut tell = |breaks: bool, text: String| changes.push(Change { text, breaks });
        let named = |all: &[IndexedComponent], name: &str| -> Option<IndexedComponent> {
            all.iter().find(|one| one.name == name).cloned()
        };
        for old in &before.components {
            let Some(new) = named(&self.components, &old.name) else {
                tell(true, format!("component `{}` is gone", old.name));
                continue;
            };
            if old.language != new.language {
                let (from, to) = (&old.language, &new.language);
                tell(
                    false,
                    format!("component `{}`: {from} became {to}", old.name),
                );
            }
            for slot in old.slots.iter().filter(|slot| !new.slots.contains(slot)) {
                tell(
                    true,
                    format!("component `{}` no longer {}", old.name, slot.text()),
                );
            }
            for slot in new.slots.iter().filter(|slot| !old.slots.contains(slot)) {
                // A new need has nobody to answer it in the networks of the earlier state.
                let needs = slot.role == Role::Requires.word();
                tell(
                    needs,
                    format!("component `{}` now {}", old.name, slot.text()),
                );
            }
        }
        for new in &self.components {
            if named(&before.components, &new.name).is_none() {
                tell(false, format!("component `{}` is new", new.name));
            }
        }
        for old in &before.interfaces {
            let new = self.interfaces.iter().find(|one| one.name == old.name);
            match new {
                None => tell(true, format!("interface `{}` is gone", old.name)),
                Some(new) if new.hashes != old.hashes => {
                    let text = "has other operations or types: the ends of the two states do not understand each other";
                    tell(true, format!("interface `{}` {text}", old.name));
                }
                Some(_) => {}
            }
        }
        for new in &self.interfaces {
            if !before.interfaces.iter().any(|one| one.name == new.name) {
                tell(false, format!("interface `{}` is new", new.name));
            }
        }
        changes
    }
}

impl IndexedSlot {
    /// `implements RoboCompLaser::Laser as front`
    fn text(&self) -> String {
        let Self {
            name,
            role,
            interface,
        } = self;
        let own = interface.rsplit("::").next() != Some(name);
        let own = if own {
            format!(" as `{name}`")
        } else {
            String::new()
        };
        format!("{role} `{interface}`{own}")
    }
}

/// The names and hashes of interfaces of a library.
fn hashes(library: &Library, ids: impl Iterator<Item = InterfaceId>) -> Vec<(String, String)> {
    let named = |id| {
        let hash = format!("{:016x}", interface_hash(library, id));
        (name_of(library, id), hash)
    };
    ids.map(named).collect()
}

/// `Module::Name`
fn name_of(library: &Library, id: InterfaceId) -> String {
    let interface = library.interface(id);
    let module = library.module(interface.module);
    format!("{}::{}", module.name.text, interface.name.text)
}

/// The errors of a file, one in each text.
fn faults(sources: &SourceMap, found: &Diagnostics) -> Vec<String> {
    let text = render(sources, found, Format::Short);
    let errors = text.lines().filter(|line| line.contains("error["));
    errors.map(str::to_owned).collect()
}

fn unreadable(file: &Path, error: &io::Error) -> Read {
    let fault = format!("{}: {error}", file.display());
    Read {
        faults: vec![clean(&fault)],
        ..Read::default()
    }
}

fn component(file: &Path, loader: &dyn Loader) -> Read {
    let mut sources = SourceMap::new();
    let (project, found) = match Project::load(file, &mut sources, loader) {
        Ok(read) => read,
        Err(error) => return unreadable(file, &error),
    };
    let faults = faults(&sources, &found);
    let Some(project) = project else {
        return Read {
            faults,
            ..Read::default()
        };
    };
    let component = &project.component;
    let library = &component.library;
    let own = || component.slots.iter().filter(|slot| !slot.of_world);
    let slots = own().map(|slot| IndexedSlot {
        name: slot.name.clone(),
        role: slot.role.word().to_owned(),
        interface: name_of(library, slot.interface),
    });
    // Only what it uses: what its imports hold besides is no fact about it.
    let used: BTreeSet<InterfaceId> = own().map(|slot| slot.interface).collect();
    let interfaces = hashes(library, used.into_iter());
    Read {
        component: Some(IndexedComponent {
            name: component.name.text.clone(),
            file: file.to_path_buf(),
            doc: component.doc.clone(),
            language: component.language.text.clone(),
            licence: licence(project.folder()),
            slots: slots.collect(),
            broken: found.has_errors(),
        }),
        interfaces,
        faults,
    }
}

fn interfaces(file: &Path, loader: &dyn Loader) -> Read {
    let mut sources = SourceMap::new();
    let text = match rc_files::read(file) {
        Ok(text) => text,
        Err(error) => return unreadable(file, &error),
    };
    let source = sources.add(file, text);
    let mut session = Session::new(&mut sources, loader);
    session.load_source(source, file);
    let (library, found) = (session.library, session.found);
    Read {
        component: None,
        interfaces: if found.has_errors() {
            Vec::new()
        } else {
            hashes(&library, (0..library.interfaces.len()).map(InterfaceId))
        },
        faults: faults(&sources, &found),
    }
}

/// The licence of a package: that of its manifest, or of the workspace that it names.
fn licence(folder: &Path) -> Option<String> {
    let manifest = |folder: &Path, name: &str| {
        let text = rc_files::read(&folder.join(name)).ok()?;
        text.parse::<toml_edit::DocumentMut>().ok()
    };
    let text = |item: &toml_edit::Item| item.as_str().map(clean);
    if let Some(cargo) = manifest(folder, "Cargo.toml") {
        let own = cargo
            .get("package")
            .and_then(|package| package.get("license"));
        return match own {
            Some(own) if own.as_str().is_some() => text(own),
            Some(_) => folder.ancestors().skip(1).take(16).find_map(|above| {
                let cargo = manifest(above, "Cargo.toml")?;
                text(cargo.get("workspace")?.get("package")?.get("license")?)
            }),
            None => None,
        };
    }
    let python = manifest(folder, "pyproject.toml")?;
    let own = python.get("project")?.get("license")?;
    text(own).or_else(|| text(own.get("text")?))
}
