//! Names and types of Rust for a component: what the templates of its generated crate print.

use super::asynchronous::{self, Asynchronous};
use super::exports::{self, Exports, trait_name};
use super::handlers::{Handler, Handlers};
use super::machine::{self, Machine, TRAIT};
use super::names;
use super::operation_names::{answer_name, error_name};
use super::worker;
use super::{parameters, qos, shapes, testing, types};
use crate::kinematics::Kinematics;
use crate::view;
use crate::view::component::Time;
use crate::view::library::Interface;
use rc_diagnostics::{Diagnostic, Diagnostics};
use rc_vocabulary::{Middleware, Role};
use serde::Serialize;
use std::collections::BTreeSet;

/// Name of a new component's worker.
pub(crate) const WORKER: &str = "SpecificWorker";

/// A component as its templates see it.
#[derive(Debug, Serialize)]
pub(crate) struct Component<'a> {
    name: &'a str,
    pub(crate) file: &'a str,
    doc: &'a [String],
    hash: &'a str,
    middleware: &'a str,
    note: &'a str,
    period: Time,
    simulates_time: bool,
    managed: bool,
    viewer: bool,
    /// The functions for its life cycle that a new worker has.
    hooks: &'static [&'static str],
    pub(crate) package: String,
    backends: Vec<BackendCrate>,
    ros_types: &'a [String],
    /// Modules of types.
    pub(crate) type_modules: Vec<Reexport>,
    /// Interfaces that slots use.
    interface_modules: Vec<Reexport>,
    pub(crate) slots: Vec<Slot<'a>>,
    /// The traits of the slots that receive.
    pub(crate) traits: Vec<String>,
    /// The trait of the worker, and the function that makes its table.
    worker_trait: &'static str,
    worker_table: &'static str,
    /// The traits that serve the slots.
    handlers: Vec<String>,
    pub(crate) parameters: Option<parameters::Parameters>,
    /// The fields of the context that have the solvers of robots, which are modules as well.
    pub(crate) kinematics: Vec<Kinematics<'a>>,
    pub(crate) machine: Option<Machine<'a>>,
    /// The traits of the worker that no slot receives by, as those of slots: the functions of the
    /// state machine, and the ends of started calls.
    pub(crate) more_traits: Vec<Slot<'a>>,
    /// The slots whose queries can be started.
    asynchronous: Vec<Asynchronous<'a>>,
    reexports: Vec<String>,
    /// Imports of the user's worker file.
    pub(crate) imports: Vec<String>,
    worker: &'static str,
    testing: testing::Testing,
    /// Whether a slot calls or publishes, or is an array.
    sends: bool,
    arrays: bool,
    /// Whether the context names the end of a slot that is not asynchronous.
    names_interfaces: bool,
    /// Types of the quality of service that slots name.
    qos_types: BTreeSet<String>,
}

/// A middleware that a component uses.
#[derive(Debug, Serialize)]
struct BackendCrate {
    word: &'static str,
    package: &'static str,
    module: String,
}

/// A module of the crate `interfaces`, under the name that the component's crate gives it.
#[derive(Debug, Serialize)]
pub(crate) struct Reexport {
    pub(crate) path: String,
    pub(crate) name: String,
    /// Whether the name differs from the last part of the path.
    renamed: bool,
    exports: Vec<String>,
}

/// One slot.
#[derive(Debug, Serialize)]
pub(crate) struct Slot<'a> {
    name: &'a str,
    pub(crate) index: usize,
    constant: String,
    /// The field of the context, and the module of its handlers.
    pub(crate) field: String,
    /// The trait of its handlers.
    pub(crate) type_name: String,
    /// `Implements`, `Requires`, `Publishes`, `SubscribesTo`.
    role: &'static str,
    role_word: &'static str,
    pub(crate) receives: bool,
    sends: bool,
    is_array: bool,
    optional: bool,
    /// The trait of its handlers in the crate `interfaces`, the one that serves it, and the type
    /// that tells it from another slot with this trait.
    handler: String,
    serving: String,
    #[serde(skip)]
    pub(crate) serving_trait: Option<String>,
    pub(crate) marker: String,
    /// The parameters of the trait where it is implemented.
    pub(crate) generics: String,
    /// Its entry in the table of the worker.
    entry: String,
    /// How the context opens it, and counts its peers; empty where it does not.
    open: String,
    peers: String,
    interface: &'a str,
    path: String,
    /// The module of the interface below `interfaces`.
    module: String,
    /// The type of the client or the publisher.
    end: String,
    type_hash: &'a str,
    backend: Option<&'a str>,
    /// Fields of the quality of service that differ from the role's default.
    qos: Vec<String>,
    types: String,
    external_types: &'a [String],
    doc: &'a [String],
    pub(crate) operations: Vec<Handler>,
    /// Functions of the trait that the worker may leave out.
    #[serde(skip)]
    pub(crate) optional_handlers: Vec<Handler>,
}

impl<'a> Component<'a> {
    /// Whether queries of a slot can be started.
    pub(crate) fn has_asynchronous(&self) -> bool {
        !self.asynchronous.is_empty()
    }

    /// Slots whose trait the worker implements: those that receive, and the other traits.
    pub(crate) fn implemented(&self) -> impl Iterator<Item = &Slot<'a>> {
        let slots = self.slots.iter().filter(|slot| slot.receives);
        slots.chain(&self.more_traits)
    }

    /// One of them, by its index.
    pub(crate) fn at(&self, index: usize) -> &Slot<'a> {
        let slots = self.slots.len();
        self.slots
            .get(index)
            .unwrap_or_else(|| &self.more_traits[index - slots])
    }
}

/// The functions for its life cycle that a new worker has; the others have useful defaults.
const HOOKS: [&str; 4] = ["configure", "activate", "deactivate", "cleanup"];

/// A trait that the worker implements for something else than a slot that receives.
fn other_trait(name: &str, trait_name: String) -> Slot<'_> {
    Slot {
        name,
        index: 0,
        constant: String::new(),
        field: String::new(),
        type_name: trait_name,
        role: "",
        role_word: "",
        receives: true,
        sends: false,
        is_array: false,
        optional: false,
        handler: String::new(),
        serving: String::new(),
        serving_trait: None,
        marker: String::new(),
        generics: String::new(),
        entry: String::new(),
        open: String::new(),
        peers: String::new(),
        interface: "",
        path: String::new(),
        module: String::new(),
        end: String::new(),
        type_hash: "",
        backend: None,
        qos: Vec::new(),
        types: String::new(),
        external_types: &[],
        doc: &[],
        operations: Vec::new(),
        optional_handlers: Vec::new(),
    }
}

/// The traits of the state machine and of the ends of started calls.
fn more_traits<'a>(
    view: &'a view::Component,
    asynchronous: &mut [Asynchronous<'a>],
) -> Vec<Slot<'a>> {
    let machine = view.machine.iter().map(|machine| Slot {
        operations: machine::functions(machine),
        ..other_trait(&machine.name, TRAIT.to_owned())
    });
    let ends = asynchronous.iter_mut().map(|slot| Slot {
        optional_handlers: std::mem::take(&mut slot.handlers),
        ..other_trait(slot.name, slot.handler.clone())
    });
    let mut all: Vec<Slot> = machine.chain(ends).collect();
    for (index, of) in all.iter_mut().enumerate() {
        of.index = view.slots.len() + index;
    }
    all
}

pub(crate) fn of(view: &view::Component) -> Component<'_> {
    let exports = Exports::of(view);
    let mut asynchronous = asynchronous::all(view, &exports);
    let mut slots: Vec<Slot> = view
        .slots
        .iter()
        .enumerate()
        .map(|(index, slot)| one(view, index, slot, &exports))
        .collect();
    mark(&mut slots);
    for (slot, of) in slots.iter_mut().zip(&view.slots) {
        slot.entry = entry(view, of, slot);
    }
    let receiving = slots.iter().filter(|slot| slot.receives);
    let mut traits: Vec<String> = receiving.map(|slot| slot.type_name.clone()).collect();
    traits.sort_by(|a, b| worker::order(a, b));
    let serving = slots.iter().filter(|slot| slot.receives);
    let handlers = serving.map(|slot| slot.serving.clone()).collect();
    Component {
        name: &view.name,
        file: &view.file,
        doc: &view.doc,
        hash: &view.hash,
        middleware: view.middleware.word(),
        note: &view.note,
        period: view.period,
        simulates_time: view.simulates_time,
        managed: view.managed,
        viewer: view.viewer,
        hooks: if view.managed { &HOOKS } else { &[] },
        package: names::package(&view.name),
        backends: view
            .middlewares
            .iter()
            .map(|middleware| BackendCrate {
                word: middleware.word(),
                package: middleware.can().package.0,
                module: middleware.module(),
            })
            .collect(),
        ros_types: &view.ros_types,
        type_modules: type_modules(view, &exports),
        interface_modules: interface_modules(view, &exports),
        parameters: view.parameters.as_ref().map(parameters::of),
        kinematics: view
            .kinematics
            .iter()
            .map(|one| Kinematics::of(one, names::snake(&one.name), &one.rust))
            .collect(),
        machine: view.machine.as_ref().map(machine::of),
        more_traits: more_traits(view, &mut asynchronous),
        reexports: reexports(view, &slots, &traits, &asynchronous),
        imports: imports(view, &slots, &traits, &asynchronous),
        asynchronous,
        worker: WORKER,
        testing: testing::of(view),
        sends: slots.iter().any(|slot| slot.sends),
        arrays: slots.iter().any(|slot| slot.is_array),
        names_interfaces: view.slots.iter().any(|s| s.sends && !s.asynchronous),
        qos_types: qos::types(view),
        worker_trait: worker_trait(view),
        worker_table: if view.managed { "managed" } else { "plain" },
        handlers,
        slots,
        traits,
    }
}

fn worker_trait(view: &view::Component) -> &'static str {
    if view.managed {
        "rc_runtime::ManagedWorker"
    } else {
        "rc_runtime::Worker"
    }
}

/// Gives a slot a type of its own if an earlier one has the same trait.
fn mark(slots: &mut [Slot]) {
    let mut taken = BTreeSet::new();
    for slot in slots.iter_mut().filter(|slot| slot.receives) {
        let path = format!("{}::{}", slot.module, slot.handler);
        if !taken.insert(path) {
            slot.marker = format!("{}Slot", slot.type_name.trim_end_matches('_'));
        }
        let begin = match slot.role {
            "Implements" => "Serve",
            _ => "Receive",
        };
        let (module, handler) = (&slot.module, &slot.handler);
        let (here, there) = match slot.marker.as_str() {
            "" => ("<Context>".to_owned(), "<Context>".to_owned()),
            marker => (
                format!("<Context, {marker}>"),
                format!("<Context, crate::slots::{marker}>"),
            ),
        };
        slot.serving = format!("interfaces::{module}::{begin}{handler}{there}");
        slot.serving_trait = Some(format!("{begin}{handler}"));
        slot.generics = here;
    }
}

/// The entry of a slot in the table of the worker.
fn entry(view: &view::Component, of: &view::Slot, slot: &Slot) -> String {
    if !slot.receives {
        return "SlotEntry::sends()".to_owned();
    }
    let (constructor, function) = match (of.role, of.is_array) {
        (Role::Implements, false) => ("serves", "serve"),
        (Role::Implements, true) => ("serves_members", "serve"),
        (_, false) => ("receives", "receive"),
        (_, true) => ("receives_members", "receive"),
    };
    let mut entry = format!(
        "SlotEntry::{constructor}(<W as {}>::{function})",
        slot.serving
    );
    if !of.available.is_empty() {
        let states = view.machine.iter().flat_map(|machine| &machine.states);
        let states = states.filter(|state| of.available.contains(&state.name));
        let states: Vec<String> = states.map(|state| state.number.to_string()).collect();
        entry.push_str(&format!(".in_states(&[{}])", states.join(", ")));
    }
    entry
}

/// Slots whose names become one name of Rust, or one that generated code uses itself.
pub(crate) fn check(component: &rc_cdsl::Component, found: &mut Diagnostics) {
    const OWN: [&str; 3] = ["core", "params", "deref"];
    let name = &component.name;
    if let Err(reason) = names::component(&name.text) {
        let message = format!("a component cannot be called `{}`: {reason}", name.text);
        found.push(Diagnostic::error("name-collision", name.span, message));
    }
    let mut seen: Vec<(&str, String)> = Vec::new();
    for slot in &component.slots {
        let field = names::snake(&slot.name);
        if let Some((other, _)) = seen.iter().find(|(_, other)| *other == field) {
            let message = format!(
                "slots `{other}` and `{}` are both `{field}` in Rust",
                slot.name
            );
            let interface = component.library.interface(slot.interface);
            let help = format!("name one of them: `{} as other`", interface.name.text);
            found.push(Diagnostic::error("name-collision", slot.span, message).help(help));
        } else if OWN.contains(&field.as_str())
            || (field == "time" && component.simulates_time)
            || (["tree", "viewer"].contains(&&*field) && component.viewer.is_some())
            || (component.state_machine.is_some()
                && ["machine", "state_machine"].contains(&&*field))
        {
            let message = format!(
                "a slot cannot be called `{}`: generated code uses the name itself",
                slot.name
            );
            found.push(
                Diagnostic::error("name-collision", slot.span, message).help("name it with `as`"),
            );
        }
        seen.push((&slot.name, field));
    }
    for (_, robot) in &component.kinematics {
        let field = names::snake(&robot.text);
        let is_own = OWN.contains(&field.as_str())
            || ["time", "tree", "viewer", "machine", "state_machine"].contains(&field.as_str());
        if is_own || seen.iter().any(|(_, other)| *other == field) {
            let message = format!(
                "a robot cannot be called `{}`: the context has `{field}` already",
                robot.text
            );
            let error = Diagnostic::error("name-collision", robot.span, message);
            found.push(error.help("write another name behind `as`"));
        }
        seen.push((&robot.text, field));
    }
}

/// The modules of types, each with the names that no other one exports.
fn type_modules(view: &view::Component, exports: &Exports) -> Vec<Reexport> {
    let mut all: Vec<Reexport> = view
        .modules
        .iter()
        .map(|module| {
            let path = names::module(&module.name);
            let name = exports::type_module(view, &module.name);
            let mut names = exports::of_types(module);
            names.retain(|name| exports.is_unique(name));
            Reexport {
                renamed: path != name,
                path,
                name,
                exports: names,
            }
        })
        .collect();
    all.sort_by(|a, b| a.name.cmp(&b.name));
    all
}

/// The interfaces of slots, each with the clients and publishers that the slots use.
fn interface_modules(view: &view::Component, exports: &Exports) -> Vec<Reexport> {
    let all = view.modules.iter().flat_map(|module| &module.interfaces);
    let mut done = Vec::new();
    for interface in all {
        let slots = view.slots.iter();
        let slots = slots.filter(|s| s.module == interface.module && s.interface == interface.name);
        let slots: Vec<&view::Slot> = slots.collect();
        if slots.is_empty() {
            continue;
        }
        let base = names::camel(&interface.name);
        let mut names = Vec::new();
        if slots.iter().any(|s| s.role == Role::Requires) {
            names.push(format!("{base}Client"));
        }
        if slots.iter().any(|s| s.role == Role::Publishes && s.sends) {
            names.push(format!("{base}Publisher"));
        }
        for operation in &interface.operations {
            if !operation.throws.is_empty() {
                names.push(error_name(&operation.name));
            }
            if operation.outputs.len() + usize::from(operation.result.is_some()) > 1 {
                names.push(answer_name(&operation.name));
            }
        }
        names.retain(|name| exports.is_unique(name));
        let own = names::module(&interface.name);
        let name = exports::interface_module(view, &interface.module, &interface.name);
        done.push(Reexport {
            renamed: own != name,
            path: format!("{}::{own}", names::module(&interface.module)),
            name,
            exports: names,
        });
    }
    done.sort_by(|a, b| a.name.cmp(&b.name));
    done
}

fn reexports(
    view: &view::Component,
    slots: &[Slot],
    traits: &[String],
    asynchronous: &[Asynchronous],
) -> Vec<String> {
    let mut paths: Vec<String> = [
        "adapter::{Handlers, embed, run}",
        "context::Context",
        "rc_runtime::middleware::{CallError, InPlace, SendError}",
        "rc_runtime::middleware::typed::{HandlerError, Request}",
        "rc_runtime::{ComponentState, Embedded, ParamChange, WorkerError, network_time, tracing}",
    ]
    .map(str::to_owned)
    .to_vec();
    let types = view.modules.iter();
    let mut types = types.filter(|m| !m.types.is_empty() || !m.constants.is_empty());
    let more = [
        ("self::interfaces::*", !view.slots.is_empty()),
        ("machine::StateMachine", view.machine.is_some()),
        ("innermodel_viewer::{self, innermodel}", view.viewer),
        ("rc_runtime::lifecycle", view.managed),
        (
            "rc_runtime::middleware::typed::{Call, CallId}",
            view.has_asynchronous(),
        ),
        (
            "rc_runtime::{Member, MemberError, SlotArray}",
            view.has_arrays(),
        ),
        ("parameters::Params", view.parameters.is_some()),
        ("types::*", types.next().is_some()),
    ];
    paths.push(if view.managed {
        "rc_runtime::ManagedWorker as Worker".to_owned()
    } else {
        "rc_runtime::Worker".to_owned()
    });
    let more = more.iter().filter(|(_, there)| *there);
    paths.extend(more.map(|(path, _)| (*path).to_owned()));
    paths.extend(traits.iter().map(|name| format!("slots::{name}")));
    paths.extend(asynchronous.iter().flat_map(|slot| {
        [&slot.client, &slot.handler].map(|name| format!("asynchronous::{name}"))
    }));
    let markers = slots.iter().filter(|slot| !slot.marker.is_empty());
    paths.extend(markers.map(|slot| format!("slots::{}", slot.marker)));
    paths.sort_by(|a, b| worker::order(a, b));
    paths
}

/// Imports of `specific_worker.rs` from the generated crate: the traits, and the types that its
/// handlers mention.
fn imports(
    view: &view::Component,
    slots: &[Slot],
    traits: &[String],
    asynchronous: &[Asynchronous],
) -> Vec<String> {
    let mut names: Vec<String> = ["Context", "Worker", "WorkerError"]
        .map(str::to_owned)
        .to_vec();
    names.extend(traits.iter().cloned());
    let markers = slots.iter().map(|slot| slot.marker.clone());
    names.extend(markers.filter(|marker| !marker.is_empty()));
    names.extend(asynchronous.iter().map(|slot| slot.handler.clone()));
    names.extend(view.machine.iter().map(|_| TRAIT.to_owned()));
    let handlers = slots
        .iter()
        .filter(|s| s.receives)
        .flat_map(|s| &s.operations);
    names.extend(handlers.flat_map(|handler| handler.mentioned.clone()));
    names.sort_by(|a, b| worker::order(a, b));
    names.dedup();
    names
}

fn one<'a>(
    view: &'a view::Component,
    index: usize,
    slot: &'a view::Slot,
    exports: &Exports,
) -> Slot<'a> {
    let module = exports::interface_module(view, &slot.module, &slot.interface);
    let interface = view.interface(slot);
    let base = names::camel(&slot.interface);
    let kind = if slot.role == Role::Publishes {
        "Publisher"
    } else {
        "Client"
    };
    let operations = interface
        .filter(|_| slot.receives)
        .map_or_else(Vec::new, |interface| {
            let handlers = Handlers {
                slot,
                module: &module,
                exports,
            };
            handlers.all(interface)
        });
    let in_place = interface.is_some_and(|i| slot.in_place && shapes::is_in_place(i, slot.role));
    let handler = interface.map(|i| shapes::trait_name(i, in_place, slot.is_array));
    let end = if slot.asynchronous {
        let client = exports::async_name(view, &slot.name, "AsyncClient");
        format!("crate::asynchronous::{client}")
    } else {
        format!("interfaces::{module}::{base}{kind}")
    };
    let (open, peers) = context(slot, index, &end);
    let shout = names::shout(&slot.name);
    Slot {
        name: &slot.name,
        index,
        constant: format!("SLOT_{shout}"),
        field: names::snake(&slot.name),
        type_name: trait_name(view, &slot.name),
        role: match slot.role {
            Role::Implements => "Implements",
            Role::Requires => "Requires",
            Role::Publishes => "Publishes",
            Role::SubscribesTo => "SubscribesTo",
        },
        role_word: slot.role.word(),
        receives: slot.receives,
        sends: slot.sends,
        is_array: slot.is_array,
        optional: slot.optional,
        handler: handler.unwrap_or_default(),
        serving: String::new(),
        serving_trait: None,
        marker: String::new(),
        generics: String::new(),
        entry: String::new(),
        open,
        peers,
        interface: &slot.interface,
        path: format!("{}::{}", slot.module, slot.interface),
        end,
        module,
        type_hash: &slot.type_hash,
        backend: slot.middleware.map(Middleware::word),
        qos: slot.qos.0.iter().map(qos::field).collect(),
        types: format!("TYPES_{shout}"),
        external_types: &slot.external_types,
        doc: interface.map_or(&[], |interface| interface.doc.as_slice()),
        operations,
        optional_handlers: Vec::new(),
    }
}

/// How the context opens a slot, and how it counts the peers of one that sends.
fn context(slot: &view::Slot, index: usize, end: &str) -> (String, String) {
    let field = names::snake(&slot.name);
    let calls = slot.role == Role::Requires;
    let open = match (slot.is_array, slot.sends) {
        (true, true) if calls => {
            format!("ports.array({index}, |ports, slot| Ok({end}::new(ports.client(slot)?)))")
        }
        (true, true) => {
            format!("ports.array({index}, |ports, slot| {end}::new(ports.publishers(slot)))")
        }
        (true, false) => format!("ports.array({index}, |_, _| Ok(()))"),
        (false, true) if calls => format!("{end}::new(ports.client({index})?)"),
        (false, true) => format!("{end}::new(ports.publishers({index}))?"),
        (false, false) => String::new(),
    };
    let count = if calls { "is_connected" } else { "subscribers" };
    let peers = match (slot.is_array, slot.sends) {
        (_, false) => String::new(),
        (true, true) if calls => {
            format!("self.{field}.count_peers(peers, |client| usize::from(client.is_connected()))")
        }
        (true, true) => format!("self.{field}.count_peers(peers, {end}::{count})"),
        (false, true) if calls => format!("peers[{index}] = usize::from(self.{field}.{count}())"),
        (false, true) => format!("peers[{index}] = self.{field}.{count}()"),
    };
    (open, peers)
}

/// Names that stand for other types in the user's files, with these types, and names that stand for
/// themselves.
pub(crate) fn meanings(view: &view::Component) -> (Vec<(String, String)>, Vec<String>) {
    let (mut aliases, mut known) = (Vec::new(), Vec::new());
    let bare = |_: &str, name: &str| names::ty(name);
    for decl in view.modules.iter().flat_map(|module| &module.types) {
        match &decl.kind {
            view::library::Kind::Alias { target } => {
                aliases.push((names::ty(&decl.name), types::owned(target, &bare)));
            }
            _ => known.push(names::ty(&decl.name)),
        }
    }
    let used = |interface: &&Interface| {
        let mut slots = view.slots.iter();
        slots.any(|s| s.module == interface.module && s.interface == interface.name)
    };
    let interfaces = view.modules.iter().flat_map(|module| &module.interfaces);
    for operation in interfaces.filter(used).flat_map(|i| &i.operations) {
        let result = operation.result.iter().map(|ty| types::owned(ty, &bare));
        let outputs = operation.outputs.iter().map(|m| types::member(m, &bare));
        let parts: Vec<String> = result.chain(outputs).collect();
        if parts.len() > 1 {
            let tuple = format!("({})", parts.join(", "));
            aliases.push((answer_name(&operation.name), tuple));
        }
        if !operation.throws.is_empty() {
            known.push(error_name(&operation.name));
        }
    }
    (aliases, known)
}
