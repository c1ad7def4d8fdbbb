//! Names and types of Rust for a component, for the templates of its generated crate.

use super::adapter::{self, Adapter};
use super::asynchronous::{self, Asynchronous};
use super::exports::Exports;
use super::freshness::{self, Freshness};
use super::machine::{self, Machine};
use super::reexports::{self, Reexport};
use super::slot::{self, Slot};
use super::worker::WORKER;
use super::worker_traits::{self, WorkerTrait};
use super::{names, parameters, qos, testing, those, world};
use crate::kinematics::Kinematics;
use crate::view;
use crate::view::component::Time;
use rc_vocabulary::Middleware;
use serde::Serialize;

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
    /// Whether a slot may convert its messages.
    converts: bool,
    viewer: bool,
    /// The functions for its life cycle that a new worker has.
    hooks: &'static [&'static str],
    pub(crate) package: String,
    backends: Vec<BackendCrate>,
    /// Whether a middleware has nodes of ROS 2, and the definitions of their types.
    has_nodes: bool,
    ros_types: &'a [String],
    /// The modules of the generated crate, as it declares them.
    modules: Vec<&'static str>,
    /// Modules of types.
    type_modules: Vec<Reexport>,
    /// Interfaces that slots use.
    interface_modules: Vec<Reexport>,
    slots: Vec<Slot<'a>>,
    /// The traits that the worker implements in addition to that of its life cycle.
    pub(crate) implemented: Vec<WorkerTrait>,
    adapter: Adapter,
    pub(crate) parameters: Option<parameters::Parameters>,
    /// The fields of the context that have the solvers of robots, which are modules as well.
    pub(crate) kinematics: Vec<Kinematics<'a>>,
    world: Option<world::World<'a>>,
    any_world: Option<world::AnyWorld<'a>>,
    pub(crate) machine: Option<Machine<'a>>,
    /// Values that know their age.
    freshness: Freshness,
    /// The slots whose queries can be started.
    asynchronous: Vec<Asynchronous<'a>>,
    reexports: Vec<String>,
    /// Imports of the module of the context.
    context_imports: Vec<String>,
    /// Arguments that the context does not need when it is opened.
    unused: Vec<&'static str>,
    /// Imports of the user's worker file.
    pub(crate) imports: Vec<String>,
    worker: &'static str,
    testing: testing::Testing,
    /// Whether a slot calls or publishes, or receives.
    sends: bool,
    #[serde(skip)]
    receives: bool,
    /// Imports of the module that describes the slots.
    description_imports: Vec<String>,
}

/// A middleware that a component uses.
#[derive(Debug, Serialize)]
struct BackendCrate {
    package: &'static str,
    /// The expression that links it.
    linked: String,
}

impl Component<'_> {
    /// Whether queries of a slot can be started.
    pub(crate) fn has_asynchronous(&self) -> bool {
        !self.asynchronous.is_empty()
    }

    /// Whether it has values that know their age.
    pub(crate) fn has_freshness(&self) -> bool {
        !self.freshness.is_empty()
    }

    /// Whether it shares the world of any network.
    pub(crate) fn has_any_world(&self) -> bool {
        self.any_world.is_some()
    }

    /// Whether it shares a world of its schema.
    pub(crate) fn has_world(&self) -> bool {
        self.world.is_some()
    }

    /// Whether a slot receives.
    pub(crate) fn receives(&self) -> bool {
        self.receives
    }
}

/// The functions for its life cycle that a new worker has; the others have useful defaults.
const HOOKS: [&str; 4] = ["configure", "activate", "deactivate", "cleanup"];

pub(crate) fn of(view: &view::Component) -> Component<'_> {
    let exports = Exports::of(view);
    let mut asynchronous = asynchronous::all(view, &exports);
    let slots = slot::all(view);
    let mut freshness = freshness::of(view, &exports);
    let mut world = world::of(view);
    let mut implemented =
        worker_traits::all(view, &slots, &mut asynchronous, &mut freshness, &exports);
    implemented.extend(world.as_mut().map(world::handlers));
    let sends = slots.iter().any(|slot| slot.sends) || world.is_some();
    let receives = slots.iter().any(|slot| slot.receives);
    let has_nodes = |middleware: &Middleware| middleware.can().has_nodes;
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
        converts: view.slots.iter().any(|slot| !slot.role.is_provided()),
        viewer: view.viewer,
        hooks: if view.managed { &HOOKS } else { &[] },
        package: names::package(&view.name),
        backends: view.middlewares.iter().copied().map(backend).collect(),
        has_nodes: view.middlewares.iter().any(has_nodes),
        ros_types: &view.ros_types,
        modules: modules(view, receives, !freshness.is_empty()),
        type_modules: reexports::type_modules(view, &exports),
        interface_modules: reexports::interface_modules(view, &exports),
        adapter: adapter::of(view, &slots, &asynchronous, &freshness),
        parameters: view.parameters.as_ref().map(parameters::of),
        kinematics: view
            .kinematics
            .iter()
            .map(|one| Kinematics::of(one, names::snake(&one.name), &one.rust))
            .collect(),
        world,
        any_world: world::any(view),
        machine: view.machine.as_ref().map(machine::of),
        reexports: reexports::of_root(view, &slots, &asynchronous, &freshness),
        context_imports: context_imports(view),
        unused: unused(view, sends),
        imports: reexports::of_worker(&implemented),
        asynchronous,
        freshness,
        worker: WORKER,
        testing: testing::of(view),
        sends,
        receives,
        description_imports: description_imports(view),
        implemented,
        slots,
    }
}

fn backend(middleware: Middleware) -> BackendCrate {
    let module = middleware.module();
    let linked = format!("{module}::LINKED");
    BackendCrate {
        package: middleware.can().package.0,
        linked: if middleware.can().has_nodes {
            format!(
                "Linked {{ connect: |environment| {module}::connect(environment, ROS_TYPES), ..{linked} }}"
            )
        } else {
            linked
        },
    }
}

/// The modules of the generated crate.
fn modules(view: &view::Component, receives: bool, keeps: bool) -> Vec<&'static str> {
    let all = [
        ("mod adapter", true),
        ("mod asynchronous", view.has_asynchronous()),
        ("mod backend", true),
        ("mod context", true),
        ("mod description", true),
        ("pub mod freshness", keeps),
        ("pub mod interfaces", true),
        ("pub mod kinematics", !view.kinematics.is_empty()),
        ("pub mod machine", view.machine.is_some()),
        ("pub mod parameters", view.parameters.is_some()),
        ("mod slots", receives),
        (
            "pub mod world",
            view.world.is_some() || view.any_world.is_some(),
        ),
    ];
    those(&all)
}

/// Imports of the module that describes the slots.
fn description_imports(view: &view::Component) -> Vec<String> {
    if view.slots.is_empty() {
        return Vec::new();
    }
    // The library knows the slots of a world.
    if view.slots.iter().all(|slot| slot.of_world) {
        return vec!["rc_runtime::Slot".to_owned()];
    }
    let qos = qos::types(view).into_iter();
    let qos = std::iter::once("Qos".to_owned()).chain(qos);
    let qos = qos.map(|ty| format!("rc_runtime::middleware::{ty}"));
    qos.chain(["rc_runtime::{Role, Slot}".to_owned()]).collect()
}

/// Imports of the module of the context.
fn context_imports(view: &view::Component) -> Vec<String> {
    let has_machine = view.machine.is_some();
    let names_interfaces = view.slots.iter().any(|s| s.sends && !s.asynchronous);
    let of_runtime = those(&[
        ("Core", true),
        ("Ports", true),
        ("SlotArray", view.has_arrays()),
        ("StartError", true),
        ("TimeSource", view.simulates_time),
        ("Values", true),
        ("WorkerContext", true),
    ]);
    let of_runtime = format!("rc_runtime::{{{}}}", of_runtime.join(", "));
    let all = [
        ("crate::interfaces", names_interfaces),
        (
            "crate::machine::{CHART, EXTERNAL, Event, State}",
            has_machine,
        ),
        ("crate::parameters::Params", view.parameters.is_some()),
        ("rc_runtime::machine::Machine", has_machine),
        ("innermodel_viewer::Viewer", view.viewer),
        ("innermodel_viewer::innermodel::InnerModel", view.viewer),
        (&of_runtime, true),
        ("std::sync::Arc", view.viewer),
    ];
    those(&all).into_iter().map(str::to_owned).collect()
}

/// Arguments that the context does not need when it is opened.
fn unused(view: &view::Component, sends: bool) -> Vec<&'static str> {
    let needs_ports = sends || view.world.is_some() || view.has_arrays() || view.simulates_time;
    those(&[
        ("ports", !needs_ports),
        ("values", view.parameters.is_none()),
    ])
}
