//! The code of workers that implements the declarations of files.

use super::file_key::key;
use super::known_files::changed_at;
use super::names::{Kind, Symbol};
use super::place::Text;
use rc_codegen::purpose::Purpose;
use rc_codegen::worker;
use rc_codegen::{FileLoader, Project};
use rc_diagnostics::{SourceId, SourceMap};
use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::time::SystemTime;

/// The most workers that are kept.
const MOST_WORKERS: usize = 1_000;

/// A piece of a component's worker.
#[derive(Clone)]
pub(super) struct Handler {
    pub(super) symbol: Symbol,
    pub(super) file: PathBuf,
    pub(super) text: Rc<Text>,
    pub(super) start: usize,
    pub(super) end: usize,
}

/// The pieces of a component's worker, as long as nothing changes.
struct Worker {
    handlers: Rc<Vec<Handler>>,
    /// The files that were read, each with the time of its last change.
    read: Vec<(Option<SystemTime>, PathBuf)>,
}

impl Worker {
    fn is_of_now(&self) -> bool {
        self.read.iter().all(|(at, path)| changed_at(path) == *at)
    }

    /// Whether its pieces depend on a file.
    fn has_read(&self, path: &Path) -> bool {
        self.read.iter().any(|(_, read)| read == path)
    }
}

/// The workers that were read.
#[derive(Default)]
pub(super) struct Workers {
    /// By the `.cdsl`.
    by_component: BTreeMap<PathBuf, Worker>,
}

impl Workers {
    /// A file has another text: workers that were read from it are read again.
    pub(super) fn forget(&mut self, path: &Path) {
        self.by_component.retain(|_, worker| !worker.has_read(path));
    }

    /// The pieces of the worker of a component, as of its files and of those in its `src`.
    pub(super) fn handlers(&mut self, cdsl: &Path, loader: &FileLoader) -> Rc<Vec<Handler>> {
        let known = self.by_component.get(cdsl);
        if let Some(known) = known.filter(|worker| worker.is_of_now()) {
            return Rc::clone(&known.handlers);
        }
        if self.by_component.len() >= MOST_WORKERS {
            self.by_component.clear();
        }
        let (handlers, read) = read_handlers(cdsl, loader);
        let handlers = Rc::new(handlers);
        let worker = Worker {
            handlers: Rc::clone(&handlers),
            read: read
                .iter()
                .map(|path| (changed_at(path), key(path)))
                .collect(),
        };
        self.by_component.insert(cdsl.to_path_buf(), worker);
        handlers
    }
}

/// The pieces of the worker of a component without errors, and the files and folders that were read.
fn read_handlers(cdsl: &Path, loader: &FileLoader) -> (Vec<Handler>, Vec<PathBuf>) {
    let mut read = vec![cdsl.to_path_buf()];
    let mut sources = SourceMap::new();
    let Ok((Some(project), found)) = Project::load(cdsl, &mut sources, loader) else {
        return (Vec::new(), read);
    };
    let src = project.code().join("src");
    read.push(src);
    if found.has_errors() {
        read.extend(sources.ids().map(|id| sources.path(id).to_path_buf()));
        return (Vec::new(), read);
    }
    let pieces = worker::handlers(&project, &mut sources).unwrap_or_default();
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

/// The component whose worker a file of Rust belongs to: the `.cdsl` next to its folder `src`.
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
