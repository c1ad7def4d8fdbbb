//! Where things are declared, and where they are named: across languages, and in the worker's Rust.

use super::names::{Kind, Names, Place, Symbol};
use super::place::Text;
use super::{Server, key};
use rc_codegen::stubs::{self, Purpose};
use rc_codegen::{FileLoader, Project};
use rc_diagnostics::{SourceId, SourceMap};
use serde_json::{Value, json};
use std::collections::{BTreeSet, HashMap};
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::time::SystemTime;

/// How many places are told of one thing.
const MOST: usize = 5_000;

/// How many files outside of the editor's folders are kept, and the pieces of how many workers.
const MOST_ELSEWHERE: usize = 1_000;
const MOST_WORKERS: usize = 1_000;

/// A piece of a component's worker.
#[derive(Clone)]
pub(super) struct Handler {
    symbol: Symbol,
    pub(super) file: PathBuf,
    pub(super) text: Rc<Text>,
    pub(super) start: usize,
    pub(super) end: usize,
}

/// The pieces of a component's worker, as long as nothing changes.
pub(super) struct Worker {
    handlers: Rc<Vec<Handler>>,
    /// What was read, and when it had changed last.
    read: Vec<(Option<SystemTime>, PathBuf)>,
}

impl Worker {
    fn is_of_now(&self) -> bool {
        self.read.iter().all(|(at, path)| changed_at(path) == *at)
    }

    /// Whether its pieces depend on a file.
    pub(super) fn has_read(&self, path: &Path) -> bool {
        self.read.iter().any(|(_, read)| read == path)
    }
}

impl Server {
    /// Makes the names of a file known, also of one that no folder of the editor has. Such a file is read
    /// again when its text on disk is another one.
    pub(super) fn know(&mut self, path: &Path) {
        if self.names.contains_key(path) {
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
        self.names.get(path).or_else(elsewhere)
    }

    /// What a place means: the first of its symbols that exists.
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

    /// The places at a position of an open file.
    pub(super) fn places(&self, path: &Path, position: &Value) -> Vec<Place> {
        let Some(names) = self.names.get(path) else {
            return Vec::new();
        };
        let byte = names.text.byte(self.encoding, position);
        let places = byte.map_or_else(Vec::new, |byte| names.at(byte));
        places.into_iter().cloned().collect()
    }

    /// Where a symbol is declared.
    fn declaration(&mut self, symbol: &Symbol) -> Option<Value> {
        if symbol.kind == Kind::File {
            return Some(self.location(&symbol.file, &Text::default(), 0, 0));
        }
        // The text of its file may have changed.
        if self.waiting.remove(&symbol.file) {
            let _ = self.check(&symbol.file);
        }
        self.know(&symbol.file);
        if !rc_files::unsaved::exists(&symbol.file) {
            return None;
        }
        let names = self.known(&symbol.file)?;
        let place = names.declaration(symbol.kind, &symbol.name)?;
        Some(self.location(&symbol.file, &names.text, place.start, place.end))
    }

    pub(super) fn location(&self, path: &Path, text: &Text, start: usize, end: usize) -> Value {
        json!({ "uri": self.address(path), "range": text.range(self.encoding, start, end) })
    }

    /// Where the thing at a position is declared; of a declaration, the code that implements it.
    pub(super) fn definition(&mut self, path: &Path, position: &Value) -> Value {
        let mut locations = Vec::new();
        let places = self.places(path, position);
        for used in places.iter().filter(|place| !place.declares) {
            let symbol = self.resolved(&used.symbols);
            locations.extend(symbol.and_then(|symbol| self.declaration(&symbol)));
        }
        for handler in self.handlers_at(path, position) {
            locations.extend(self.declaration(&handler));
        }
        if locations.is_empty() {
            locations = self.implementations(&places);
        }
        if locations.is_empty() {
            let declared = places.iter().find(|place| place.declares);
            let symbol = declared.and_then(|place| place.symbols.first());
            locations.extend(symbol.and_then(|symbol| self.declaration(symbol)));
        }
        json!(once(locations))
    }

    /// The code that implements the thing at a position.
    pub(super) fn implementation(&mut self, path: &Path, position: &Value) -> Value {
        let places = self.places(path, position);
        json!(self.implementations(&places))
    }

    fn implementations(&mut self, places: &[Place]) -> Vec<Value> {
        let symbols: BTreeSet<Symbol> = places
            .iter()
            .filter_map(|place| self.resolved(&place.symbols))
            .collect();
        let handlers = self.handlers_of(&symbols);
        let locations = handlers.iter().map(|handler| self.handler(handler));
        once(locations.collect())
    }

    fn handler(&self, handler: &Handler) -> Value {
        self.location(&handler.file, &handler.text, handler.start, handler.end)
    }

    /// The symbols at a position.
    pub(super) fn symbols(&mut self, path: &Path, position: &Value) -> BTreeSet<Symbol> {
        let mut symbols = BTreeSet::new();
        for place in self.places(path, position) {
            if place.declares {
                symbols.extend(place.symbols);
            } else {
                symbols.extend(self.resolved(&place.symbols));
            }
        }
        symbols.extend(self.handlers_at(path, position));
        symbols
    }

    /// Where the thing at a position is named in all files.
    pub(super) fn references(&mut self, path: &Path, position: &Value, declared: bool) -> Value {
        let symbols = self.symbols(path, position);
        let mut locations = Vec::new();
        for (path, places) in self.named(&symbols) {
            let Some(names) = self.names.get(&path) else {
                continue;
            };
            let places = places.iter().filter(|place| declared || !place.declares);
            let places =
                places.map(|place| self.location(&path, &names.text, place.start, place.end));
            locations.extend(places.take(MOST));
        }
        let handlers = self.handlers_of(&symbols);
        locations.extend(handlers.iter().map(|handler| self.handler(handler)));
        locations.truncate(MOST);
        json!(once(locations))
    }

    /// The other places of an open file that name the thing at a position.
    pub(super) fn highlights(&mut self, path: &Path, position: &Value) -> Value {
        let symbols = self.symbols(path, position);
        let places = self.named_in(path, &symbols);
        let Some(names) = self.names.get(path) else {
            return Value::Null;
        };
        let ranges = places
            .iter()
            .map(|place| names.text.range(self.encoding, place.start, place.end));
        let ranges = once(ranges.collect()).into_iter();
        json!(
            ranges
                .map(|range| json!({ "range": range }))
                .collect::<Vec<_>>()
        )
    }

    /// All places of all files that name one of `symbols`, by file.
    pub(super) fn named(&mut self, symbols: &BTreeSet<Symbol>) -> Vec<(PathBuf, Vec<Place>)> {
        let paths: Vec<PathBuf> = self.names.keys().cloned().collect();
        let places = paths.into_iter().map(|path| {
            let places = self.named_in(&path, symbols);
            (path, places)
        });
        places.filter(|(_, places)| !places.is_empty()).collect()
    }

    fn named_in(&mut self, path: &Path, symbols: &BTreeSet<Symbol>) -> Vec<Place> {
        let near = |symbol: &Symbol| match symbol.kind {
            Kind::OfComponent => symbols.iter().any(|one| one.name == symbol.name),
            Kind::OfSlot => {
                let operation = symbol.name.rsplit('.').next();
                symbols.iter().any(|one| {
                    one.kind == Kind::Operation && one.name.rsplit('.').next() == operation
                })
            }
            Kind::OfGroup => {
                let slot = symbol.name.rsplit('.').next().unwrap_or_default();
                symbols
                    .iter()
                    .any(|one| one.kind == Kind::Slot && one.name == slot)
            }
            _ => symbols.contains(symbol),
        };
        let names = self.names.get(path);
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

    /// The pieces of workers that implement one of `symbols`: of the components that name it.
    pub(super) fn handlers_of(&mut self, symbols: &BTreeSet<Symbol>) -> Vec<Handler> {
        let mut components = BTreeSet::new();
        for symbol in symbols {
            let named = match symbol.kind {
                Kind::Slot => {
                    components.insert(symbol.file.clone());
                    continue;
                }
                Kind::Operation => Symbol {
                    kind: Kind::Interface,
                    name: symbol.name.split('.').next().unwrap_or_default().to_owned(),
                    file: symbol.file.clone(),
                },
                Kind::State => Symbol {
                    kind: Kind::File,
                    name: String::new(),
                    file: symbol.file.clone(),
                },
                _ => continue,
            };
            let users = self.named(&BTreeSet::from([named])).into_iter();
            let users = users.map(|(path, _)| path);
            components.extend(users.filter(|path| path.extension().is_some_and(|e| e == "cdsl")));
        }
        let mut all = Vec::new();
        for cdsl in components {
            let handlers = self.handlers(&cdsl);
            all.extend(
                handlers
                    .iter()
                    .filter(|one| symbols.contains(&one.symbol))
                    .cloned(),
            );
        }
        all
    }

    /// What the piece of a worker at a position is for.
    fn handlers_at(&mut self, path: &Path, position: &Value) -> Vec<Symbol> {
        let Some(cdsl) = component_of(path) else {
            return Vec::new();
        };
        let encoding = self.encoding;
        let all = self.handlers(&cdsl);
        let here = all.iter().filter(|handler| {
            let byte = handler.text.byte(encoding, position);
            let inside = |byte| handler.start <= byte && byte <= handler.end;
            handler.file == path && byte.is_some_and(inside)
        });
        here.map(|handler| handler.symbol.clone()).collect()
    }

    /// The pieces of the worker of a component, as of its files and of those in its `src`.
    fn handlers(&mut self, cdsl: &Path) -> Rc<Vec<Handler>> {
        let known = self.workers.get(cdsl);
        if let Some(known) = known.filter(|worker| worker.is_of_now()) {
            return Rc::clone(&known.handlers);
        }
        if self.workers.len() >= MOST_WORKERS {
            self.workers.clear();
        }
        let (handlers, read) = self.read_handlers(cdsl);
        let handlers = Rc::new(handlers);
        let worker = Worker {
            handlers: Rc::clone(&handlers),
            read: read
                .iter()
                .map(|path| (changed_at(path), key(path)))
                .collect(),
        };
        self.workers.insert(cdsl.to_path_buf(), worker);
        handlers
    }

    /// The pieces of the worker of a component without errors, and the files and folders that were read.
    fn read_handlers(&self, cdsl: &Path) -> (Vec<Handler>, Vec<PathBuf>) {
        let mut read = vec![cdsl.to_path_buf()];
        let mut sources = SourceMap::new();
        let loader = FileLoader::new(&self.include);
        let Ok((Some(project), found)) = Project::load(cdsl, &mut sources, &loader) else {
            return (Vec::new(), read);
        };
        let src = project.code().join("src");
        read.push(src);
        if found.has_errors() {
            read.extend(sources.ids().map(|id| sources.path(id).to_path_buf()));
            return (Vec::new(), read);
        }
        let pieces = stubs::handlers(&project, &mut sources).unwrap_or_default();
        for id in sources.ids() {
            let path = sources.path(id);
            read.push(path.to_path_buf());
            read.extend(path.parent().map(Path::to_path_buf));
        }
        read.sort();
        read.dedup();
        let library = &project.component.library;
        let mut texts: HashMap<SourceId, Rc<Text>> = HashMap::new();
        let pieces = pieces.into_iter().filter_map(|(purpose, span)| {
            let symbol = match purpose {
                Purpose::Slot(slot) => Symbol {
                    file: key(cdsl),
                    kind: Kind::Slot,
                    name: project.component.slots.get(slot)?.name.clone(),
                },
                Purpose::Operation(slot, operation) => {
                    let slot = project.component.slots.get(slot)?;
                    let interface = library.interface(slot.interface);
                    let operation = interface.operations.get(operation)?;
                    Symbol {
                        file: key(sources.path(library.module(interface.module).source)),
                        kind: Kind::Operation,
                        name: format!("{}.{}", interface.name.text, operation.name.text),
                    }
                }
                Purpose::State(name) => {
                    let machine = project.component.state_machine.as_ref()?;
                    Symbol {
                        file: key(&project.folder().join(&machine.file.text)),
                        kind: Kind::State,
                        name,
                    }
                }
            };
            Some(Handler {
                symbol,
                file: key(sources.path(span.source)),
                text: Rc::clone(
                    texts
                        .entry(span.source)
                        .or_insert_with(|| Rc::new(Text::new(sources.text(span.source)))),
                ),
                start: span.start,
                end: span.end,
            })
        });
        (pieces.collect(), read)
    }
}

/// When a file or a folder changed last, as the system says it.
fn changed_at(path: &Path) -> Option<SystemTime> {
    path.metadata().and_then(|data| data.modified()).ok()
}

/// The component whose worker a file of Rust belongs to: the `.cdsl` beside its folder `src`.
pub(super) fn component_of(path: &Path) -> Option<PathBuf> {
    if !["rs", "py"]
        .iter()
        .any(|ending| path.extension().is_some_and(|e| e == *ending))
    {
        return None;
    }
    let mut folders = path.ancestors().skip(1);
    let src = folders.find(|folder| folder.file_name().is_some_and(|name| name == "src"))?;
    let entries = std::fs::read_dir(src.parent()?).ok()?.flatten();
    let files = entries.map(|entry| entry.path());
    files
        .filter(|path| path.extension().is_some_and(|e| e == "cdsl"))
        .min()
        .map(|path| key(&path))
}

/// Each value once, in their order.
fn once(values: Vec<Value>) -> Vec<Value> {
    let mut seen = BTreeSet::new();
    let values = values.into_iter();
    values
        .filter(|value| seen.insert(value.to_string()))
        .collect()
}
