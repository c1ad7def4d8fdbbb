//! The names of files, as of their last checks.

use super::file_key::Keys;
use super::names::{Kind, Names, Place, Symbol};
use super::place::Encoding;
use crate::check::{self, Model};
use rc_codegen::FileLoader;
use rc_ddsl::Deployment;
use rc_diagnostics::{Diagnostics, Severity, SourceId, SourceMap};
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// The most files outside of the editor's folders.
const MOST_ELSEWHERE: usize = 1_000;

/// The result of reading a file.
pub(super) struct CheckedFiles {
    pub(super) names: Names,
    pub(super) sources: SourceMap,
    /// The file of each source.
    pub(super) keys: HashMap<SourceId, PathBuf>,
    pub(super) found: Diagnostics,
    pub(super) network: Option<Box<Deployment>>,
}

/// The names of files.
#[derive(Debug, Default)]
pub(super) struct KnownFiles {
    include: Vec<PathBuf>,
    /// Those of all checked files.
    checked: BTreeMap<PathBuf, Names>,
    /// Those that a file had when it could be read, where it cannot be read now.
    last: BTreeMap<PathBuf, Names>,
    /// Those of files outside of the folders, and when each had changed last.
    elsewhere: BTreeMap<PathBuf, (Option<SystemTime>, Names)>,
}

impl KnownFiles {
    /// No file; imports are also looked for in the folders `include`.
    pub(super) fn new(include: &[PathBuf]) -> Self {
        Self {
            include: include.to_vec(),
            ..Self::default()
        }
    }

    /// A loader that finds imports.
    pub(super) fn loader(&self) -> FileLoader {
        FileLoader::new(&self.include)
    }

    /// Reads a file with all that it names. A file that was deleted, or is not text, has no
    /// findings and no names.
    pub(super) fn look_at(&self, path: &Path) -> CheckedFiles {
        let mut sources = SourceMap::new();
        let mut found = Diagnostics::new();
        let loader = self.loader();
        let include = &self.include;
        let old = check::is_of_robocomp(path);
        let model = check::file(path, old, &mut sources, &loader, include, &mut found);
        let model = model.ok().flatten();
        if old {
            found = check::softened(found);
        }
        let mut known = Keys::default();
        let ids = sources.ids();
        let keys = ids.map(|id| (id, known.of(sources.path(id)))).collect();
        let mut names = Names::of(path, &sources, &keys, known, model.as_ref(), &loader);
        names.has_mistake = found.iter().any(|one| {
            one.severity == Severity::Error
                && keys.get(&one.span.source).is_some_and(|key| key == path)
        });
        let network = match model {
            Some(Model::Network(network)) => Some(network),
            _ => None,
        };
        CheckedFiles {
            names,
            sources,
            keys,
            found,
            network,
        }
    }

    /// Takes the names of a file that was checked.
    pub(super) fn put(&mut self, path: &Path, names: Names) {
        let is_readable = !names.places.is_empty();
        let before = self.checked.insert(path.to_path_buf(), names);
        if is_readable {
            self.last.remove(path);
        } else if let Some(before) = before.filter(|names| !names.places.is_empty()) {
            self.last.insert(path.to_path_buf(), before);
        }
    }

    /// Forgets a deleted file.
    pub(super) fn remove(&mut self, path: &Path) {
        self.checked.remove(path);
        self.last.remove(path);
    }

    /// The names of a checked file.
    pub(super) fn get(&self, path: &Path) -> Option<&Names> {
        self.checked.get(path)
    }

    /// All checked files.
    pub(super) fn iter(&self) -> impl Iterator<Item = (&PathBuf, &Names)> {
        self.checked.iter()
    }

    /// The names of a file, or those that it had when it could be read.
    pub(super) fn readable(&self, path: &Path) -> Option<&Names> {
        let names = self.checked.get(path);
        let names = names.filter(|names| !names.places.is_empty());
        names.or_else(|| self.last.get(path))
    }

    /// The names of files with an ending, without those that come with the program.
    pub(super) fn with_ending(&self, ending: &str) -> impl Iterator<Item = (&PathBuf, &Names)> {
        let of = move |path: &Path| path.extension().is_some_and(|e| e == ending);
        let files = self.checked.keys().filter(move |path| of(path));
        files.filter_map(|path| Some((path, self.readable(path)?)))
    }

    /// Makes the names of a file known, also of one that no folder of the editor has. Such a file is read
    /// again when its text on disk is another one.
    pub(super) fn know(&mut self, path: &Path) {
        if self.checked.contains_key(path) {
            return;
        }
        let changed = changed_at(path);
        let known = self.elsewhere.get(path);
        if known.is_some_and(|(at, _)| *at == changed) {
            return;
        }
        if self.elsewhere.len() >= MOST_ELSEWHERE {
            self.elsewhere.clear();
        }
        let names = self.look_at(path).names;
        self.elsewhere.insert(path.to_path_buf(), (changed, names));
    }

    /// The names of a file that are known.
    pub(super) fn known(&self, path: &Path) -> Option<&Names> {
        let elsewhere = || self.elsewhere.get(path).map(|(_, names)| names);
        self.checked.get(path).or_else(elsewhere)
    }

    /// The places at a position of a checked file.
    pub(super) fn places(&self, path: &Path, position: &Value, encoding: Encoding) -> Vec<Place> {
        let Some(names) = self.checked.get(path) else {
            return Vec::new();
        };
        let byte = names.text.byte(encoding, position);
        let places = byte.map_or_else(Vec::new, |byte| names.at(byte));
        places.into_iter().cloned().collect()
    }

    /// Resolves a place: the first of its symbols that exists.
    pub(super) fn resolved(&mut self, symbols: &[Symbol]) -> Option<Symbol> {
        for symbol in symbols {
            if symbol.kind == Kind::File {
                if rc_files::unsaved::exists(&symbol.file) {
                    return Some(symbol.clone());
                }
                continue;
            }
            self.know(&symbol.file);
            if symbol.kind == Kind::OfGroup {
                let slot = self.exported(symbol);
                if slot.is_some() {
                    return slot;
                }
                continue;
            }
            if symbol.kind == Kind::BesideExport {
                let slot = self.beside_export(symbol);
                if slot.is_some() {
                    return slot;
                }
                continue;
            }
            if symbol.kind == Kind::OfSlot {
                let operation = self.operation_of(symbol);
                if operation.is_some() {
                    return operation;
                }
                continue;
            }
            let files = match (symbol.kind, self.known(&symbol.file)) {
                (Kind::OfComponent, Some(names)) => names.parameters.clone(),
                (Kind::OfComponent, None) => Vec::new(),
                _ => vec![symbol.file.clone()],
            };
            let kind = match symbol.kind {
                Kind::OfComponent => Kind::Parameter,
                kind => kind,
            };
            for file in files {
                self.know(&file);
                let declared = self.known(&file);
                if declared.is_some_and(|names| names.declaration(kind, &symbol.name).is_some()) {
                    let name = symbol.name.clone();
                    return Some(Symbol { file, kind, name });
                }
            }
        }
        None
    }

    /// The operation of a slot, in the file of its interface.
    fn operation_of(&self, symbol: &Symbol) -> Option<Symbol> {
        let (slot, operation) = symbol.name.split_once('.')?;
        let names = self.known(&symbol.file)?;
        let slot = names.slots.iter().find(|one| one.name == slot)?;
        let interface = slot.interface.rsplit("::").next()?;
        let mut symbols = names.places.iter().flat_map(|place| &place.symbols);
        let found = symbols.find(|one| one.kind == Kind::Interface && one.name == interface)?;
        Some(Symbol {
            file: found.file.clone(),
            kind: Kind::Operation,
            name: format!("{interface}.{operation}"),
        })
    }

    /// The slot that a group exports: of those with its name directly in the group, the only one that
    /// provides its interface, else the only one. Which slot an inner group exports is asked likewise.
    fn exported(&mut self, symbol: &Symbol) -> Option<Symbol> {
        let (group, slot) = symbol.name.rsplit_once('.')?;
        let mut all = Vec::new();
        self.candidates(&symbol.file, group, slot, &mut all);
        let providers: Vec<&(Symbol, bool)> =
            all.iter().filter(|(_, provides)| *provides).collect();
        match (providers.as_slice(), all.as_slice()) {
            ([(one, _)], _) | ([], [(one, _)]) => Some(one.clone()),
            _ => None,
        }
    }

    /// The slot of the component whose slot a group exports.
    fn beside_export(&mut self, symbol: &Symbol) -> Option<Symbol> {
        let (exported, name) = symbol.name.split_once('/')?;
        let exported = self.exported(&Symbol {
            kind: Kind::OfGroup,
            name: exported.to_owned(),
            ..symbol.clone()
        })?;
        let names = self.known(&exported.file)?;
        names.declaration(Kind::Slot, name)?;
        let name = name.to_owned();
        Some(Symbol { name, ..exported })
    }

    /// Adds the slots directly in a group with a name, and whether they provide their interface.
    fn candidates(&mut self, file: &Path, group: &str, slot: &str, all: &mut Vec<(Symbol, bool)>) {
        let network = self.known(file);
        let Some(known) = network.and_then(|names| names.groups.get(group)) else {
            return;
        };
        let (components, groups) = (known.components.clone(), known.groups.clone());
        for cdsl in components {
            self.know(&cdsl);
            let slots = self.known(&cdsl).map_or(&[][..], |names| &names.slots);
            let Some(named) = slots.iter().find(|one| one.name == slot) else {
                continue;
            };
            let provides = named.role.is_provided();
            let symbol = Symbol {
                file: cdsl,
                kind: Kind::Slot,
                name: slot.to_owned(),
            };
            all.push((symbol, provides));
        }
        for inner in groups {
            let network = self.known(file);
            let known = network.and_then(|names| names.groups.get(&inner));
            if known.is_none_or(|group| !group.exports.iter().any(|name| name == slot)) {
                continue;
            }
            let symbol = Symbol {
                file: file.to_path_buf(),
                kind: Kind::OfGroup,
                name: format!("{inner}.{slot}"),
            };
            if let Some(meant) = self.exported(&symbol) {
                let names = self.known(&meant.file);
                let slots = names.map_or(&[][..], |names| &names.slots);
                let named = slots.iter().find(|one| one.name == slot);
                let provides = named.is_some_and(|one| one.role.is_provided());
                all.push((meant, provides));
            }
        }
        // Two instances of one component have one slot in its text.
        all.sort();
        all.dedup();
    }

    /// All places of all files that name one of `symbols`, by file.
    pub(super) fn named(&mut self, symbols: &BTreeSet<Symbol>) -> Vec<(PathBuf, Vec<Place>)> {
        let paths: Vec<PathBuf> = self.checked.keys().cloned().collect();
        let places = paths.into_iter().map(|path| {
            let places = self.named_in(&path, symbols);
            (path, places)
        });
        places.filter(|(_, places)| !places.is_empty()).collect()
    }

    /// The places of a file that name one of `symbols`.
    pub(super) fn named_in(&mut self, path: &Path, symbols: &BTreeSet<Symbol>) -> Vec<Place> {
        let near = |symbol: &Symbol| match symbol.kind {
            Kind::OfComponent => symbols.iter().any(|one| one.name == symbol.name),
            Kind::OfSlot => {
                let operation = symbol.name.rsplit('.').next();
                symbols.iter().any(|one| {
                    one.kind == Kind::Operation && one.name.rsplit('.').next() == operation
                })
            }
            Kind::OfGroup | Kind::BesideExport => {
                let slot = symbol.name.rsplit(['.', '/']).next().unwrap_or_default();
                symbols
                    .iter()
                    .any(|one| one.kind == Kind::Slot && one.name == slot)
            }
            _ => symbols.contains(symbol),
        };
        let names = self.checked.get(path);
        let places = names.into_iter().flat_map(|names| &names.places);
        let places = places.filter(|place| place.symbols.iter().any(near));
        let places: Vec<Place> = places.cloned().collect();
        let mut kept = Vec::new();
        for place in places {
            let same = if place.declares {
                place.symbols.iter().any(|symbol| symbols.contains(symbol))
            } else {
                let meant = self.resolved(&place.symbols);
                meant.is_some_and(|symbol| symbols.contains(&symbol))
            };
            if same {
                kept.push(place);
            }
        }
        kept
    }
}

/// When a file or a folder changed last, as the system says it.
pub(super) fn changed_at(path: &Path) -> Option<SystemTime> {
    path.metadata().and_then(|data| data.modified()).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_cannot_be_read_keeps_the_names_that_it_had() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("parts.idsl");
        let mut files = KnownFiles::default();
        let mut check = |text: &str| {
            std::fs::write(&path, text).expect("a file");
            let looked = files.look_at(&path);
            files.put(&path, looked.names);
            let declares = |names: &Names| names.declaration(Kind::Type, "Point").is_some();
            (
                files.get(&path).is_some_and(declares),
                files.readable(&path).is_some_and(declares),
            )
        };
        assert_eq!(
            check("module Parts { struct Point { int x; }; };"),
            (true, true)
        );
        assert_eq!(check("what is this"), (false, true));
        assert_eq!(
            check("module Parts { struct Other { int x; }; };"),
            (false, false)
        );
        files.remove(&path);
        assert!(files.readable(&path).is_none());
    }
}
