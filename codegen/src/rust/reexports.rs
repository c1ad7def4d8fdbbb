//! The exports of the generated crate of a component, and the imports of the user's worker.

use super::asynchronous::Asynchronous;
use super::exports::{self, Exports};
use super::freshness::Freshness;
use super::operation_names::{answer_name, error_name};
use super::slot::Slot;
use super::worker_traits::WorkerTrait;
use super::{names, worker};
use crate::view;
use rc_vocabulary::Role;
use serde::Serialize;

/// A module of the crate `interfaces`, under the name that the component's crate gives it.
#[derive(Debug, Serialize)]
pub(crate) struct Reexport {
    /// The path below `interfaces`.
    path: String,
    #[serde(skip)]
    name: String,
    /// The paths that the component's crate exports: the module, and names of it.
    uses: Vec<String>,
}

impl Reexport {
    fn of(path: String, name: String, exports: &[String]) -> Self {
        let own = path.rsplit("::").next().unwrap_or_default();
        let mut uses = vec![if own == name {
            format!("::interfaces::{path}")
        } else {
            format!("::interfaces::{path} as {name}")
        }];
        if !exports.is_empty() {
            uses.push(format!("self::{name}::{{ {} }}", exports.join(", ")));
        }
        Self { path, name, uses }
    }
}

/// The modules of types, each with the names that no other one exports.
pub(super) fn type_modules(view: &view::Component, exports: &Exports) -> Vec<Reexport> {
    let mut all: Vec<Reexport> = view
        .modules
        .iter()
        .map(|module| {
            let path = names::module(&module.name);
            let name = exports::type_module(view, &module.name);
            let mut names = exports::of_types(module);
            names.retain(|name| exports.is_unique(name));
            Reexport::of(path, name, &names)
        })
        .collect();
    all.sort_by(|a, b| a.name.cmp(&b.name));
    all
}

/// The interfaces of slots, each with the clients and publishers that the slots use.
pub(super) fn interface_modules(view: &view::Component, exports: &Exports) -> Vec<Reexport> {
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
        let path = format!("{}::{own}", names::module(&interface.module));
        done.push(Reexport::of(path, name, &names));
    }
    done.sort_by(|a, b| a.name.cmp(&b.name));
    done
}

/// The paths that the root of the generated crate exports.
pub(super) fn of_root(
    view: &view::Component,
    slots: &[Slot],
    asynchronous: &[Asynchronous],
    freshness: &Freshness,
) -> Vec<String> {
    let mut paths: Vec<String> = ["adapter::{Handlers, embed, run}", "context::Context"]
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
        ("freshness::Collecting", !view.collects.is_empty()),
        (
            "rc_runtime::middleware::{Fresh, Made}",
            !freshness.is_empty(),
        ),
        ("world::WorldHandlers", view.world.is_some()),
    ];
    paths.push(if view.managed {
        "rc_runtime::ManagedWorker as Worker".to_owned()
    } else {
        "rc_runtime::Worker".to_owned()
    });
    let more = more.iter().filter(|(_, there)| *there);
    paths.extend(more.map(|(path, _)| (*path).to_owned()));
    let receiving = slots.iter().filter(|slot| slot.receives);
    let receiving = receiving.map(|slot| slot.type_name.clone());
    paths.extend(asynchronous.iter().flat_map(|slot| {
        [&slot.client, &slot.handler].map(|name| format!("asynchronous::{name}"))
    }));
    paths.extend(
        freshness
            .types()
            .iter()
            .map(|ty| format!("freshness::{ty}")),
    );
    let markers = slots.iter().filter(|slot| !slot.marker.is_empty());
    let markers = markers.map(|slot| slot.marker.clone());
    let names: Vec<String> = receiving.chain(markers).collect();
    match names.as_slice() {
        [] => {}
        [one] => paths.push(format!("slots::{one}")),
        several => paths.push(format!("slots::{{{}}}", several.join(", "))),
    }
    paths.sort_by(|a, b| worker::order(a, b));
    paths
}

/// Imports of `specific_worker.rs` from the generated crate: the traits, and the types that its
/// handlers mention.
pub(super) fn of_worker(implemented: &[WorkerTrait]) -> Vec<String> {
    let mut names: Vec<String> = ["Context", "Worker", "WorkerError"]
        .map(str::to_owned)
        .to_vec();
    for of in implemented {
        names.push(of.name.clone());
        let markers = of.slot.iter().map(|served| served.marker.clone());
        names.extend(markers.filter(|marker| !marker.is_empty()));
        names.extend(
            of.operations
                .iter()
                .flat_map(|handler| handler.mentioned.clone()),
        );
    }
    names.sort_by(|a, b| worker::order(a, b));
    names.dedup();
    names
}
