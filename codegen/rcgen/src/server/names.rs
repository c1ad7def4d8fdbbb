//! The names in a file and their meanings, only from the models that checks build.

mod libraries;
mod networks;
mod parameters;

use super::file_key::Keys;
use super::place::Text;
use crate::check::Model;
use rc_cdsl::model::{Role, Slot};
use rc_codegen::Project;
use rc_diagnostics::{Name, SourceId, SourceMap, Span};
use rc_idsl::model::{Library, ModuleId, TypeId};
use rc_smdsl::StateMachine;
use rc_syntax::{Loader, Trivia};
use rc_vocabulary::qos::{PolicyName, Qos};
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};

/// The limit of memory for the names of a file, in bytes. A path of parameters names each step with
/// all earlier ones, so a text of 1 MB could name more than a machine holds.
const MOST_BYTES: usize = 32 << 20;

/// The kind of a symbol.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) enum Kind {
    /// A file as a whole.
    File,
    Module,
    Constant,
    Type,
    /// A member of a struct or an exception, or an enumerator.
    Member,
    Interface,
    Operation,
    Component,
    Slot,
    Parameter,
    /// A parameter of a component, which the files of parameters of its `.cdsl` declare.
    OfComponent,
    Machine,
    State,
    Network,
    Host,
    Process,
    Group,
    Instance,
    /// A slot that a group exports, `GROUP.SLOT`, in the network of the file.
    OfGroup,
    /// A slot of the component whose slot a group exports: `GROUP.EXPORTED/SLOT`.
    BesideExport,
    /// An operation of a slot, `SLOT.OPERATION`, in the component of the file.
    OfSlot,
    /// A member of a slot array of an instance.
    ArrayMember,
}

/// A thing that a file declares.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) struct Symbol {
    /// The file, by the key of unsaved texts.
    pub(super) file: PathBuf,
    pub(super) kind: Kind,
    /// Name, unique among those of its kind in the file.
    pub(super) name: String,
}

/// A place of a file that names something.
#[derive(Clone, Debug)]
pub(super) struct Place {
    /// The range of bytes.
    pub(super) start: usize,
    pub(super) end: usize,
    /// Its possible meanings. The first one that exists counts.
    pub(super) symbols: Vec<Symbol>,
    pub(super) declares: bool,
}

/// A slot of a component.
#[derive(Clone, Debug)]
pub(super) struct SlotName {
    pub(super) name: String,
    pub(super) role: Role,
    /// `Module::Name`
    pub(super) interface: String,
    pub(super) is_array: bool,
    /// Whether it is a topic of the shared world, which no connection names.
    pub(super) of_world: bool,
}

/// A slot of a component or of a group, by the path of the latter.
#[derive(Debug)]
pub(super) struct SlotOf {
    pub(super) place: String,
    pub(super) slot: String,
}

impl SlotOf {
    /// Whether it is the slot `COMPONENT.SLOT`: of a group, that of a component inside.
    pub(super) fn is(&self, path: &str) -> bool {
        let inside = path.strip_prefix(&self.place);
        let inside = inside.and_then(|rest| rest.strip_suffix(&self.slot));
        inside.is_some_and(|between| between.starts_with('.') && between.ends_with('.'))
    }
}

/// A `bind` of a network.
#[derive(Debug)]
pub(super) struct BindName {
    pub(super) consumer: SlotOf,
    pub(super) provider: SlotOf,
    /// Its end.
    pub(super) end: usize,
}

/// The contents of a group of a network.
#[derive(Debug, Default)]
pub(super) struct GroupName {
    /// The files of the components directly in it.
    pub(super) components: Vec<PathBuf>,
    /// The paths of the groups directly in it.
    pub(super) groups: Vec<String>,
    /// The slots that it exports.
    pub(super) exports: Vec<String>,
}

/// The names of one file.
#[derive(Debug, Default)]
pub(super) struct Names {
    /// The text in which they have their places.
    pub(super) text: Text,
    /// The places, in the order of the text.
    pub(super) places: Vec<Place>,
    /// Whether the text has an error, which may hide the meaning of a word.
    pub(super) has_mistake: bool,
    /// Each declared symbol with the index of its place.
    declared: HashMap<(Kind, String), usize>,
    /// The files of a component's parameters.
    pub(super) parameters: Vec<PathBuf>,
    /// The slots of a component.
    pub(super) slots: Vec<SlotName>,
    /// The component of a configuration.
    pub(super) component: Option<PathBuf>,
    /// The components of a network by their paths, each with its file.
    pub(super) instances: Vec<(String, PathBuf)>,
    /// The groups of a network, by their paths.
    pub(super) groups: HashMap<String, GroupName>,
    /// The `bind`s of this file.
    pub(super) binds: Vec<BindName>,
    /// The networks that a network imports.
    pub(super) networks: Vec<PathBuf>,
    /// The sizes of types, for people.
    pub(super) sizes: HashMap<String, String>,
    /// Hints, each after a byte: sizes, numbers of enumerators, quality of service.
    pub(super) hints: Vec<(usize, String)>,
}

impl Names {
    /// The names of `path`, whose check read `sources` with `loader` and gave `model`. `files` has the
    /// key of each source, and `keys` those of paths.
    pub(super) fn of(
        path: &Path,
        sources: &SourceMap,
        files: &HashMap<SourceId, PathBuf>,
        keys: Keys,
        model: Option<&Model>,
        loader: &dyn Loader,
    ) -> Self {
        let own = sources
            .ids()
            .find(|id| files.get(id).is_some_and(|f| f == path));
        let Some(own) = own else {
            return Self::default();
        };
        let mut collector = Collector {
            path,
            files,
            names: Self {
                text: Text::new(sources.text(own)),
                ..Self::default()
            },
            seen: HashSet::new(),
            left: MOST_BYTES,
            keys,
        };
        match model {
            Some(Model::Component(project)) => collector.component(project, sources),
            Some(Model::Interfaces(library)) => collector.library(library),
            Some(Model::Parameters(source)) => collector.parameters(sources, *source, loader),
            Some(Model::Machine(machine)) => collector.machine(machine),
            Some(Model::Network(network)) => collector.network(network),
            Some(Model::Configuration(source, cdsl)) => {
                let cdsl = collector.keys.of(cdsl);
                collector.configuration(sources, *source, &cdsl);
            }
            None => {}
        }
        let mut names = collector.names;
        names.places.sort_by_key(|place| (place.start, place.end));
        for (at, place) in names.places.iter().enumerate() {
            for symbol in place.symbols.iter().filter(|_| place.declares) {
                let known = (symbol.kind, symbol.name.clone());
                names.declared.entry(known).or_insert(at);
            }
        }
        names
    }

    /// The place that declares a symbol.
    pub(super) fn declaration(&self, kind: Kind, name: &str) -> Option<&Place> {
        let at = self.declared.get(&(kind, name.to_owned()))?;
        self.places.get(*at)
    }

    /// The modules that the file names.
    pub(super) fn imported(&self) -> Vec<Symbol> {
        let used = self.places.iter().filter(|place| !place.declares);
        let symbols = used.flat_map(|place| &place.symbols);
        let mut modules: Vec<Symbol> = symbols
            .filter(|symbol| symbol.kind == Kind::Module)
            .cloned()
            .collect();
        modules.sort();
        modules.dedup();
        modules
    }

    /// The declarations of a kind in the file: name, the declaration as written without its block,
    /// and its documentation.
    pub(super) fn declarations(&self, kind: Kind) -> Vec<(String, String, String)> {
        let trivia = Trivia::new(self.text.as_str());
        let places = self.places.iter().filter(|place| place.declares);
        let symbols = places.filter_map(|place| {
            let symbol = place.symbols.iter().find(|symbol| symbol.kind == kind)?;
            Some((place, symbol))
        });
        symbols
            .map(|(place, symbol)| {
                let (written, doc) = self.written(&trivia, place, kind);
                (symbol.name.clone(), written, doc)
            })
            .collect()
    }

    /// A symbol's declaration as it is written, without its block, and its documentation.
    pub(super) fn declared(&self, kind: Kind, name: &str) -> Option<(String, String)> {
        let place = self.declaration(kind, name)?;
        Some(self.written(&Trivia::new(self.text.as_str()), place, kind))
    }

    /// A declaration as it is written, without its block, and its documentation.
    fn written(&self, trivia: &Trivia<'_>, place: &Place, kind: Kind) -> (String, String) {
        let text = self.text.as_str();
        let separators: &[char] = &[';', '{', '}'];
        let before = text[..place.start].rfind(separators).map_or(0, |at| at + 1);
        let comments = trivia.comments();
        let comment = comments.partition_point(|(_, end)| *end <= place.start);
        let comment = comment.checked_sub(1).map_or(0, |at| comments[at].1);
        let start = before.max(comment);
        let start = place.start - text[start..place.start].trim_start().len();
        // The choices of a parameter are in braces, but not a block.
        let word = text[start..].split_whitespace().next().unwrap_or_default();
        let is_block = matches!(word.to_ascii_lowercase().as_str(), "group" | "list");
        let ends: &[char] = match kind {
            Kind::Parameter if !is_block => &[';'],
            _ => separators,
        };
        let rest = text[place.end..].find(ends);
        let end = rest.map_or(text.len(), |at| place.end + at);
        let words: Vec<&str> = text[start..end].split_whitespace().collect();
        (words.join(" "), trivia.documentation(start).join("\n"))
    }

    /// The places at a byte, the shortest first.
    pub(super) fn at(&self, byte: usize) -> Vec<&Place> {
        let before = self.places.partition_point(|place| place.start <= byte);
        let places = self.places[..before].iter().rev();
        let mut places: Vec<&Place> = places.filter(|place| byte <= place.end).collect();
        places.sort_by_key(|place| place.end - place.start);
        places
    }
}

/// Collects the names of one file.
struct Collector<'a> {
    path: &'a Path,
    files: &'a HashMap<SourceId, PathBuf>,
    names: Names,
    /// The places that declare something: a model may have a declaration twice.
    seen: HashSet<Span>,
    /// The bytes that are left for names.
    left: usize,
    keys: Keys,
}

impl Collector<'_> {
    /// The file of a text.
    fn file(&self, source: SourceId) -> PathBuf {
        self.files.get(&source).cloned().unwrap_or_default()
    }

    fn symbol(&self, kind: Kind, source: SourceId, name: impl Into<String>) -> Symbol {
        Symbol {
            file: self.file(source),
            kind,
            name: name.into(),
        }
    }

    /// The symbol that is the file `path` as a whole.
    fn whole(path: PathBuf) -> Symbol {
        Symbol {
            file: path,
            kind: Kind::File,
            name: String::new(),
        }
    }

    fn add(&mut self, span: Span, symbols: Vec<Symbol>, declares: bool) {
        let is_own = self.files.get(&span.source).is_some_and(|f| f == self.path);
        // A name that the model made up has no place.
        if !is_own || span.start == span.end || symbols.is_empty() {
            return;
        }
        let size = |symbol: &Symbol| {
            let path = symbol.file.as_os_str().len();
            size_of::<Symbol>() + path + symbol.name.len()
        };
        let needed = size_of::<Place>() + symbols.iter().map(size).sum::<usize>();
        let Some(left) = self.left.checked_sub(needed) else {
            self.left = 0;
            return;
        };
        self.left = left;
        self.names.places.push(Place {
            start: span.start,
            end: span.end,
            symbols,
            declares,
        });
    }

    /// Whether there is no room for further names, so that none needs to be made.
    fn is_full(&self) -> bool {
        self.left == 0
    }

    /// Adds information after a place of this file that its text does not contain.
    fn hint(&mut self, span: Span, text: String) {
        let is_own = self.files.get(&span.source).is_some_and(|f| f == self.path);
        let Some(left) = self.left.checked_sub(text.len()).filter(|_| is_own) else {
            return;
        };
        if text.is_empty() {
            return;
        }
        self.left = left;
        self.names.hints.push((span.end, text));
    }

    fn refers(&mut self, span: Span, symbol: Symbol) {
        self.add(span, vec![symbol], false);
    }

    /// A declaration, with its name among those of its kind.
    fn declares(&mut self, kind: Kind, name: &Name, path: impl Into<String>) {
        if self.seen.insert(name.span) {
            let symbol = self.symbol(kind, name.span.source, path);
            self.add(name.span, vec![symbol], true);
        }
    }

    /// A file that is named relative to the one with the name.
    fn beside(&mut self, folder: &Path, file: &Name) {
        let path = self.keys.of(&folder.join(&file.text));
        self.refers(file.span, Self::whole(path));
    }

    fn ty(&self, library: &Library, id: TypeId) -> Symbol {
        let declared = library.ty(id);
        let source = library.module(declared.module).source;
        self.symbol(Kind::Type, source, declared.name.text.as_str())
    }

    fn module(&self, library: &Library, id: ModuleId) -> Symbol {
        let module = library.module(id);
        self.symbol(Kind::Module, module.source, module.name.text.as_str())
    }

    fn component(&mut self, project: &Project, sources: &SourceMap) {
        let component = &project.component;
        let folder = project.folder().to_path_buf();
        let name = &component.name;
        let symbols = vec![
            self.symbol(Kind::Component, name.span.source, name.text.as_str()),
            Self::whole(self.path.to_path_buf()),
        ];
        self.add(name.span, symbols, true);
        self.library(&component.library);
        if let Some(file) = &component.parameters {
            self.beside(&folder, file);
        }
        let machine = component.state_machine.as_ref();
        if let Some(machine) = machine {
            self.beside(&folder, &machine.file);
        }
        let machine = machine.map(|machine| self.keys.of(&folder.join(&machine.file.text)));
        for slot in &component.slots {
            self.slot(&component.library, slot);
            for state in &slot.available {
                if let Some(machine) = &machine {
                    let symbol = Symbol {
                        file: machine.clone(),
                        kind: Kind::State,
                        name: state.text.clone(),
                    };
                    self.refers(state.span, symbol);
                }
            }
        }
        let all = sources.ids().filter_map(|id| self.files.get(&id));
        let all = all.filter(|path| path.extension().is_some_and(|e| e == "pdsl"));
        self.names.parameters = all.cloned().collect();
    }

    fn slot(&mut self, library: &Library, slot: &Slot) {
        let interface = library.interface(slot.interface);
        let source = library.module(interface.module).source;
        let symbol = self.symbol(Kind::Interface, source, interface.name.text.as_str());
        self.refers(slot.interface_span, symbol);
        let span = slot.name_span.unwrap_or(slot.interface_span);
        self.declares(Kind::Slot, &Name::new("", span), slot.name.as_str());
        self.hint(span, quality(slot));
        self.names.slots.push(SlotName {
            name: slot.name.clone(),
            role: slot.role,
            interface: library.interface_path(slot.interface),
            is_array: slot.is_array,
            of_world: slot.of_world,
        });
    }

    fn machine(&mut self, machine: &StateMachine) {
        let name = &machine.name;
        self.declares(Kind::Machine, name, name.text.as_str());
        for state in &machine.states {
            self.declares(Kind::State, &state.name, state.name.text.as_str());
        }
        for (span, id) in &machine.references {
            let state = &machine.state(*id).name;
            let symbol = self.symbol(Kind::State, state.span.source, state.text.as_str());
            self.refers(*span, symbol);
        }
    }
}

/// The quality of service of a slot that its declaration does not set.
fn quality(slot: &Slot) -> String {
    let names: &[PolicyName] = match slot.role {
        Role::Implements => &[],
        Role::Requires => &[PolicyName::Timeout],
        Role::Publishes | Role::SubscribesTo => &[
            PolicyName::Reliability,
            PolicyName::Durability,
            PolicyName::Depth,
        ],
    };
    let defaults = Qos::of(slot.role);
    let unset = names.iter().filter(|name| slot.qos.get(**name).is_none());
    let texts: Vec<String> = unset
        .map(|name| format!("{} {}", name.word(), defaults.get(*name).value()))
        .collect();
    texts.join(", ")
}
