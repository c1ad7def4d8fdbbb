//! Names and types of Python for a component, for the templates of its package.

use super::imports::Imports;
use super::interfaces::{self, InterfaceFile};
use super::library::{TypeModule, Types};
use super::machine::{self, Machine};
use super::parameters::{self, Parameters};
use super::testing::{self, Testing};
use super::world::World;
use super::{documentation, handlers, layout, names};
use crate::kinematics::Kinematics;
use crate::view;
use crate::view::library::Kind;
use handlers::Handler;
use rc_vocabulary::Role;
use serde::Serialize;
use std::collections::BTreeMap;

/// Name of the worker of a new component.
pub(crate) const WORKER: &str = "SpecificWorker";

/// The module of the worker in `src`.
pub(crate) const WORKER_MODULE: &str = "specific_worker";

/// Names that generated packages export: no type of an interface hides them.
const OWN: [&str; 27] = [
    "COMPONENT",
    "CallError",
    "Context",
    "Deadline",
    "Emergency",
    "Event",
    "Fatal",
    "InvalidArgument",
    "InvalidSample",
    "Machine",
    "Member",
    "MemberError",
    "NoServer",
    "ParamChange",
    "Params",
    "QueueFull",
    "Refused",
    "SendError",
    "ServerDied",
    "SlotArray",
    "State",
    "Stopping",
    "Unavailable",
    "Worker",
    "WorkerError",
    "interfaces",
    "types",
];

/// Additions for packages of components whose values have ages.
const OF_AGES: [&str; 5] = ["Fresh", "Freshness", "Made", "NoValue", "Stale"];

/// A component as its templates see it.
#[derive(Debug, Serialize)]
pub(crate) struct Component<'a> {
    pub(crate) name: &'a str,
    pub(crate) file: &'a str,
    doc: String,
    pub(crate) package: String,
    managed: bool,
    /// The class of Qt that the worker is, if it is a window.
    window: Option<&'static str>,
    simulates_time: bool,
    /// Whether it has a tree of InnerModel, and a window for it.
    viewer: bool,
    /// The world that it shares with others.
    pub(crate) world: Option<World<'a>>,
    arrays: bool,
    /// Whether values of slots have ages.
    ages: bool,
    /// The handlers of collections.
    collected: Vec<Handler>,
    pub(crate) slots: Vec<Slot<'a>>,
    /// The slots that call or publish, and those that implement or subscribe.
    sends: bool,
    receives: bool,
    pub(crate) types: Vec<TypeModule>,
    pub(crate) interfaces: Vec<InterfaceFile>,
    pub(crate) parameters: Option<Parameters>,
    /// The fields of the context that have the solvers of robots, which are modules as well.
    pub(crate) kinematics: Vec<Kinematics<'a>>,
    pub(crate) machine: Option<Machine<'a>>,
    /// The classes of the description's types: `"Module::Name"` and the expression.
    classes: Vec<(String, String)>,
    /// The lines that `__init__` imports, and its `__all__`.
    imports: Vec<String>,
    exports: Vec<String>,
    worker_imports: Imports,
    worker_base: &'static str,
    context_imports: Imports,
    context_base: &'static str,
    /// The slots that the context opens.
    opened: Vec<Opened>,
    user: User,
    testing: Testing,
}

/// A slot that calls or publishes, or an array, as the context opens it.
#[derive(Debug, Serialize)]
struct Opened {
    /// The field, with its type where a checker cannot find it.
    target: String,
    value: String,
    doc: String,
}

/// Contents of the user's new worker.
#[derive(Debug, Serialize)]
struct User {
    import: String,
    numpy: bool,
    npt: bool,
    hooks: &'static [&'static str],
    handlers: Vec<Handler>,
    machine: Vec<Handler>,
}

/// One slot.
#[derive(Debug, Serialize)]
pub(crate) struct Slot<'a> {
    pub(crate) name: &'a str,
    index: usize,
    pub(crate) field: String,
    role: &'a str,
    pub(crate) sends: bool,
    calls: bool,
    is_array: bool,
    optional: bool,
    interface: &'a str,
    /// The file of the interface and its class for this slot.
    module: String,
    class: String,
    pub(crate) handlers: Vec<Handler>,
}

impl Component<'_> {
    /// The functions that the worker must write, with the names that its file uses.
    pub(crate) fn required(&self) -> Vec<Handler> {
        let mut all = self.user.handlers.clone();
        all.extend(self.user.machine.iter().cloned());
        if self.machine.is_none() {
            all.insert(0, handlers::of_hook("compute", &[]));
        }
        all
    }

    /// The functions that it may write.
    pub(crate) fn hooks(&self) -> Vec<Handler> {
        let mut all: Vec<Handler> = ["initialize", "emergency", "restore", "finalize"]
            .map(|name| handlers::of_hook(name, &[]))
            .to_vec();
        if self.machine.is_some() {
            all.push(handlers::of_hook("compute", &[]));
        }
        if self.parameters.is_some() {
            let changes = [("changes", "Sequence[ParamChange]")];
            all.push(handlers::of_hook("params_changed", &changes));
        }
        if self.managed {
            let hooks = ["configure", "activate", "deactivate", "cleanup", "shutdown"];
            all.extend(hooks.map(|name| handlers::of_hook(name, &[])));
            all.push(handlers::of_hook(
                "error",
                &[("transition", "str"), ("reason", "str")],
            ));
        }
        let of_world = self.world.iter().flat_map(World::hooks);
        all.extend(of_world.map(|(name, more)| handlers::of_hook(name, &more)));
        for suffix in self.machine.iter().flat_map(Machine::suffixes) {
            let hooks = ["entry", "exit", "during"].map(|what| format!("{what}_{suffix}"));
            all.extend(hooks.iter().map(|name| handlers::of_hook(name, &[])));
        }
        all
    }

    /// The prefix of the names of handlers.
    pub(crate) fn handler_prefixes(&self) -> impl Iterator<Item = String> {
        let slots = self.slots.iter().filter(|slot| !slot.handlers.is_empty());
        let slots = slots.map(|slot| format!("{}_", slot.field.trim_end_matches('_')));
        let machine = self.machine.iter();
        slots.chain(machine.flat_map(|_| ["entry_", "exit_", "during_"].map(str::to_owned)))
    }

    /// Whether an annotation that the user wrote may mean the type that is needed. Names that are
    /// not known may mean anything.
    pub(crate) fn may_mean(&self, needed: &str, own: &str) -> bool {
        const KNOWN: [&str; 9] = [
            "bool", "bytes", "dict", "float", "int", "list", "None", "str", "tuple",
        ];
        let plain = |text: &str| {
            let parts = text.split_inclusive(|c: char| !(c.is_alphanumeric() || "_.".contains(c)));
            let last = parts.map(|part| part.rsplit('.').next().unwrap_or_default());
            last.collect::<String>().replace([' ', '"', '\''], "")
        };
        let (needed, own) = (plain(needed), plain(own));
        let mut words = own.split(|c: char| !(c.is_alphanumeric() || c == '_'));
        let is_known = |word: &str| {
            word.is_empty() || KNOWN.contains(&word) || self.exports.iter().any(|name| name == word)
        };
        // An alias of the description, and NumPy's short names, denote other types.
        let has_aliases = self.types.iter().any(|module| module.has_alias_in(&own));
        needed == own || has_aliases || !words.all(is_known)
    }

    pub(crate) fn type_stems(&self) -> Vec<&str> {
        sorted(self.types.iter().map(|module| module.stem.as_str()))
    }

    pub(crate) fn interface_stems(&self) -> Vec<&str> {
        sorted(self.interfaces.iter().map(|file| file.stem.as_str()))
    }
}

fn sorted<'a>(stems: impl Iterator<Item = &'a str>) -> Vec<&'a str> {
    let mut stems: Vec<&str> = stems.collect();
    stems.sort_unstable();
    stems
}

/// The functions for its life cycle that a new worker has; the others have useful defaults.
const HOOKS: [&str; 4] = ["configure", "activate", "deactivate", "cleanup"];

pub(crate) fn of(view: &view::Component) -> Component<'_> {
    let types = Types::of(view);
    let modules: Vec<TypeModule> = view.modules.iter().map(|m| types.module(m)).collect();
    let interfaces = interfaces::of(view);
    let unique = unique(&modules, &interfaces, view.has_ages());
    let slots = view.slots.iter().enumerate();
    let slots: Vec<Slot> = slots.map(|(at, slot)| one(view, at, slot)).collect();
    let machine = view.machine.as_ref().map(machine::of);
    let world = super::world::of(view);
    let user = user(view, &slots, &unique);
    let collected = view.collects.iter();
    let collected: Vec<Handler> = collected.map(|of| handlers::of_collect(view, of)).collect();
    let handlers = || {
        slots
            .iter()
            .flat_map(|slot| &slot.handlers)
            .chain(&collected)
    };
    let signatures: Vec<&str> = handlers().map(|h| h.signature.as_str()).collect();
    let stems = modules.iter().map(|module| (&module.stem, "types"));
    let stems = stems.chain(interfaces.iter().map(|file| (&file.stem, "interfaces")));
    let worker_imports = stems.filter_map(|(stem, folder)| {
        let alias = if folder == "types" { "_" } else { "_i_" };
        layout::mentions(&signatures, &format!("{alias}{stem}."))
            .then(|| format!("from .{folder} import {stem} as {alias}{stem}"))
    });
    let mut worker_imports: Vec<String> = worker_imports.collect();
    worker_imports.sort();
    worker_imports.insert(0, "from .context import Context".to_owned());
    if world.as_ref().is_some_and(World::reads) {
        worker_imports.insert(0, "from . import world as _world".to_owned());
    }
    let context_base = match (view.viewer, world.is_some()) {
        (true, true) => "_innermodel.InnerModelContext, _shared.WorldContext",
        (true, false) => "_innermodel.InnerModelContext",
        (false, true) => "_shared.WorldContext",
        (false, false) => "_robocomp.Context",
    };
    let (imports, exports) = exports(view, &modules, &interfaces, &unique);
    Component {
        name: &view.name,
        file: &view.file,
        doc: documentation::docstring_or(
            0,
            &view.doc,
            format!("What the component `{}` communicates.", view.name),
        ),
        package: names::package(&view.name),
        managed: view.managed,
        window: view.window,
        simulates_time: view.simulates_time,
        viewer: view.viewer,
        world,
        arrays: view.has_arrays(),
        ages: view.has_ages(),
        sends: slots.iter().any(|slot| slot.sends),
        receives: handlers().next().is_some(),
        worker_imports: Imports::of(
            &signatures,
            &[
                ("_robocomp.", true),
                ("_pathlib.", view.window.is_some()),
                ("_window.", view.window.is_some()),
            ],
            worker_imports,
        ),
        worker_base: if view.managed {
            "ManagedWorker"
        } else {
            "Worker"
        },
        context_imports: context_imports(view, &interfaces),
        context_base,
        opened: std::iter::zip(&slots, &view.slots)
            .filter_map(|(slot, of)| opened(slot, of))
            .collect(),
        classes: classes(view, &interfaces),
        types: modules,
        interfaces,
        parameters: view.parameters.as_ref().map(parameters::of),
        kinematics: view
            .kinematics
            .iter()
            .map(|one| Kinematics::of(one, names::snake(&one.name), &one.python))
            .collect(),
        machine,
        collected,
        imports,
        exports,
        user,
        testing: testing::of(view, &types),
        slots,
    }
}

fn one<'a>(view: &'a view::Component, index: usize, slot: &'a view::Slot) -> Slot<'a> {
    let interface = view.interface(slot);
    let class = names::class(&slot.interface);
    let calls = slot.role == Role::Requires;
    let end = if calls { "Client" } else { "Publisher" };
    Slot {
        name: &slot.name,
        index,
        field: names::snake(&slot.name),
        role: slot.role.word(),
        sends: slot.sends,
        calls,
        is_array: slot.is_array,
        optional: slot.optional,
        interface: &slot.interface,
        module: interfaces::stem(view, &slot.module, &slot.interface),
        class: format!("{class}{end}"),
        handlers: match interface {
            Some(interface) if slot.receives => handlers::of(view, slot, interface),
            _ => Vec::new(),
        },
    }
}

fn context_imports(view: &view::Component, interfaces: &[InterfaceFile]) -> Imports {
    let ends = interfaces.iter().filter(|file| file.has_ends());
    let ends = ends.map(|file| format!("from .interfaces import {0} as _{0}", file.stem));
    let robots = view.kinematics.iter().map(|one| names::snake(&one.name));
    let robots =
        robots.map(|field| format!("from .kinematics import {field} as _kinematics_{field}"));
    let parts = [
        (view.machine.is_some(), "from .machine import Machine"),
        (view.parameters.is_some(), "from .parameters import Params"),
        (view.world.is_some(), "from .world import READS as _READS"),
        (view.world.is_some(), "from .world import World"),
    ];
    let parts = parts.iter().filter(|(there, _)| *there);
    let parts = parts.map(|(_, line)| (*line).to_owned());
    let words = [
        ("_abc.", view.parameters.is_some()),
        ("_typing.", view.parameters.is_some()),
        ("_robocomp.", true),
        ("_innermodel.", view.viewer),
        ("_shared.", view.world.is_some()),
    ];
    Imports::of(&[], &words, ends.chain(robots).chain(parts).collect())
}

fn opened(slot: &Slot, of: &view::Slot) -> Option<Opened> {
    let aged = if of.keeps_newest() {
        Some(("Samples", "The newest samples"))
    } else if of.serves_latest() {
        Some(("Results", "The results that answer queries"))
    } else {
        None
    };
    if let Some((word, what)) = aged {
        let class = names::class(slot.interface);
        return Some(Opened {
            target: slot.field.clone(),
            value: format!("_{}.{class}{word}(link, {})", slot.module, slot.index),
            doc: format!("{what} of `{}`.", slot.name),
        });
    }
    let Slot {
        index,
        field,
        role,
        interface,
        ..
    } = slot;
    let class = format!("_{}.{}", slot.module, slot.class);
    let (target, value) = match (slot.is_array, slot.sends) {
        (true, true) => (
            field.clone(),
            format!("_robocomp.SlotArray(link, {index}, {class})"),
        ),
        (true, false) => (
            format!("{field}: _robocomp.SlotArray[None]"),
            format!(
                "_robocomp.SlotArray(\n            link, {index}, lambda _link, _slot: None\n        )"
            ),
        ),
        (false, true) => (field.clone(), format!("{class}(link, {index})")),
        (false, false) => return None,
    };
    let doc = match (slot.is_array, slot.optional) {
        (true, true) => format!(
            "{role} `{interface}[]`: open its members in `initialize`. They are optional: calls raise `NoServer` without a server."
        ),
        (true, false) => format!("{role} `{interface}[]`: open its members in `initialize`."),
        (false, true) => {
            format!("{role} `{interface}`, optional: calls raise `NoServer` without a server.")
        }
        (false, false) => format!("{role} `{interface}`."),
    };
    Some(Opened { target, value, doc })
}

/// Where names come from that only one module declares: the name, and the module that the package
/// imports it from.
fn unique(
    modules: &[TypeModule],
    interfaces: &[InterfaceFile],
    has_ages: bool,
) -> BTreeMap<String, String> {
    let mut all: BTreeMap<String, Vec<String>> = BTreeMap::new();
    let types = modules.iter().flat_map(|m| {
        m.exports
            .iter()
            .map(move |name| (name, format!("types.{}", m.stem)))
    });
    let ends = interfaces.iter().flat_map(|i| {
        i.exports
            .iter()
            .map(move |name| (name, format!("interfaces.{}", i.stem)))
    });
    for (name, from) in types.chain(ends) {
        all.entry(name.clone()).or_default().push(from);
    }
    let is_own = |name: &str| OWN.contains(&name) || has_ages && OF_AGES.contains(&name);
    all.into_iter()
        .filter(|(name, from)| from.len() == 1 && !is_own(name))
        .filter_map(|(name, from)| Some((name, from.into_iter().next()?)))
        .collect()
}

/// The imports of `__init__`, and the names that it exports.
fn exports(
    view: &view::Component,
    modules: &[TypeModule],
    interfaces: &[InterfaceFile],
    unique: &BTreeMap<String, String>,
) -> (Vec<String>, Vec<String>) {
    let mut from: BTreeMap<String, Vec<String>> = BTreeMap::new();
    let mut add = |module: &str, names: &[&str]| {
        let names = names.iter().map(|name| (*name).to_owned());
        from.entry(module.to_owned()).or_default().extend(names);
    };
    add("context", &["Context"]);
    add("worker", &["Worker"]);
    if view.parameters.is_some() {
        add("parameters", &["Params"]);
    }
    if view.machine.is_some() {
        add("machine", &["Event", "Machine", "State"]);
    }
    for (name, module) in unique {
        add(module, &[name]);
    }
    let mut exports: Vec<String> = from.values().flatten().cloned().collect();
    exports.extend(
        OWN.map(str::to_owned)
            .into_iter()
            .filter(|name| match name.as_str() {
                "Member" | "MemberError" | "SlotArray" => view.has_arrays(),
                "Params" => view.parameters.is_some(),
                "Event" | "Machine" | "State" => view.machine.is_some(),
                "types" => !modules.is_empty(),
                "interfaces" => !interfaces.is_empty(),
                _ => true,
            }),
    );
    if view.has_ages() {
        exports.extend(OF_AGES.map(str::to_owned));
    }
    layout::sort_all(&mut exports);
    let mut imports: Vec<String> = Vec::new();
    let mut folders = Vec::new();
    if !interfaces.is_empty() {
        folders.push("interfaces".to_owned());
    }
    if !modules.is_empty() {
        folders.push("types".to_owned());
    }
    if !folders.is_empty() {
        imports.push(layout::import(".", &folders));
    }
    for (module, mut names) in from {
        layout::sort(&mut names);
        imports.push(layout::import(&format!(".{module}"), &names));
    }
    (imports, exports)
}

fn classes(view: &view::Component, interfaces: &[InterfaceFile]) -> Vec<(String, String)> {
    let mut all = Vec::new();
    for module in &view.modules {
        for decl in &module.types {
            if !matches!(decl.kind, Kind::Alias { .. }) {
                let class = names::class(&decl.name);
                all.push((
                    format!("{}::{}", module.name, decl.name),
                    format!("types.{}.{class}", names::module(&module.name)),
                ));
            }
        }
    }
    for file in interfaces {
        all.extend(file.answers().map(|(operation, class)| {
            let key = format!("{}::{}.{operation}", file.module, file.name);
            (key, format!("interfaces.{}.{class}", file.stem))
        }));
    }
    all
}

fn user(view: &view::Component, slots: &[Slot], unique: &BTreeMap<String, String>) -> User {
    let collected = view.collects.iter();
    let collected = collected.map(|of| handlers::of_user_collect(view, of, unique));
    let handlers: Vec<Handler> = slots
        .iter()
        .zip(&view.slots)
        .filter(|(slot, _)| !slot.handlers.is_empty())
        .filter_map(|(_, of)| Some(handlers::of_user(view, of, view.interface(of)?, unique)))
        .flatten()
        .chain(collected)
        .collect();
    let machine = view.machine.as_ref().map(handlers::of_machine);
    let machine = machine.unwrap_or_default();
    let mut names: Vec<String> = ["Context", "Worker"].map(str::to_owned).to_vec();
    names.extend(
        handlers
            .iter()
            .flat_map(|handler| handler.mentioned.clone()),
    );
    layout::sort(&mut names);
    let texts: Vec<&str> = handlers.iter().map(|h| h.signature.as_str()).collect();
    User {
        import: layout::import(&names::package(&view.name), &names),
        numpy: layout::mentions(&texts, "np."),
        npt: layout::mentions(&texts, "npt."),
        hooks: if view.managed { &HOOKS } else { &[] },
        handlers,
        machine,
    }
}
