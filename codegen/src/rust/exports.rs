//! Which names the generated crate exports more than once. The user's file writes such a name with
//! its whole path; it imports everything else by its bare name.

use super::in_place;
use super::names;
use super::operation_names::{answer_name, error_name};
use crate::view;
use rc_vocabulary::Role;
use std::collections::BTreeSet;

/// Names that every generated crate exports.
const OWN: [&str; 12] = [
    "CallError",
    "ComponentState",
    "Context",
    "Embedded",
    "Handlers",
    "InPlace",
    "ParamChange",
    "Params",
    "SendError",
    "State",
    "Worker",
    "WorkerError",
];

/// Names that the generated crate of a component with slot arrays exports in addition.
const OF_ARRAYS: [&str; 3] = ["Member", "MemberError", "SlotArray"];

/// Names that the generated crate of a component with asynchronous slots exports in addition.
const OF_CALLS: [&str; 2] = ["Call", "CallId"];

/// Names that the generated crate exports for every description.
fn own(component: &view::Component) -> impl Iterator<Item = &'static str> {
    let of_arrays = OF_ARRAYS.into_iter().filter(|_| component.has_arrays());
    let of_calls = OF_CALLS.into_iter();
    let of_calls = of_calls.filter(|_| component.has_asynchronous());
    OWN.into_iter().chain(of_arrays).chain(of_calls)
}

/// A type or trait of an asynchronous slot, whose name ends with `end`.
pub(super) fn async_name(component: &view::Component, slot: &str, end: &str) -> String {
    let mut name = format!("{}{end}", names::ty(slot).trim_end_matches('_'));
    let mut slots = component.slots.iter();
    if slots.any(|slot| trait_name(component, &slot.name) == name) {
        name.push('_');
    }
    name
}

/// The trait of a slot.
pub(super) fn trait_name(component: &view::Component, slot: &str) -> String {
    let name = names::ty(slot);
    if own(component).any(|own| own == name) {
        name + "_"
    } else {
        name
    }
}

/// The module of the types of an IDSL module, below `types` in the generated crate.
pub(super) fn type_module(component: &view::Component, module: &str) -> String {
    let own = names::module(module);
    // `module Laser { interface Laser { … }; };`: code that uses both has to tell them apart.
    let mut interfaces = component.modules.iter().flat_map(|m| &m.interfaces);
    if interfaces.any(|i| names::module(&i.name) == own) {
        own + "_types"
    } else {
        own
    }
}

/// The module of an interface, below `interfaces` in the generated crate.
pub(super) fn interface_module(component: &view::Component, module: &str, name: &str) -> String {
    let own = names::module(name);
    let interfaces = component.modules.iter().flat_map(|m| &m.interfaces);
    if interfaces.filter(|i| names::module(&i.name) == own).count() > 1 {
        format!("{}_{own}", names::snake(module))
    } else {
        own
    }
}

pub(super) struct Exports<'a> {
    component: &'a view::Component,
    krate: String,
    repeated: BTreeSet<String>,
}

impl<'a> Exports<'a> {
    pub(super) fn of(component: &'a view::Component) -> Self {
        let mut names: Vec<String> = own(component).map(str::to_owned).collect();
        for module in &component.modules {
            names.extend(of_types(module));
        }
        let mut interfaces: Vec<_> = component
            .slots
            .iter()
            .map(|slot| (&slot.module, &slot.interface))
            .collect();
        interfaces.sort();
        interfaces.dedup();
        let all = component.modules.iter().flat_map(|m| &m.interfaces);
        for interface in all.filter(|i| interfaces.contains(&(&i.module, &i.name))) {
            let base = names::camel(&interface.name);
            names.extend(["Client", "Publisher"].map(|end| format!("{base}{end}")));
            for operation in &interface.operations {
                names.extend([error_name(&operation.name), answer_name(&operation.name)]);
            }
        }
        let slots = component.slots.iter();
        let slots = slots.filter(|s| matches!(s.role, Role::Implements | Role::SubscribesTo));
        names.extend(slots.map(|s| trait_name(component, &s.name)));
        let asynchronous = component.slots.iter().filter(|slot| slot.asynchronous);
        names.extend(asynchronous.flat_map(|slot| {
            ["AsyncClient", "Done"].map(|end| async_name(component, &slot.name, end))
        }));
        names.sort();
        let repeated = names.windows(2).filter(|pair| pair[0] == pair[1]);
        Self {
            component,
            krate: format!("{}_generated", names::package(&component.name)),
            repeated: repeated.map(|pair| pair[0].clone()).collect(),
        }
    }

    /// Whether the user's file may import this name.
    pub(super) fn is_unique(&self, name: &str) -> bool {
        !self.repeated.contains(name)
    }

    /// A type as the user's file writes it.
    pub(super) fn ty(&self, module: &str, name: &str) -> String {
        let module = format!("types::{}", type_module(self.component, module));
        self.named(&module, &names::ty(name))
    }

    /// The structure of a type in shared memory as the user's file writes it.
    pub(super) fn in_place(&self, module: &str, name: &str) -> String {
        let module = format!("types::{}", type_module(self.component, module));
        self.named(&module, &in_place::path(&names::ty(name)))
    }

    /// The error or the reply of an operation as the user's file writes it; `module` is its
    /// interface's.
    pub(super) fn of_interface(&self, module: &str, name: &str) -> String {
        self.named(&format!("interfaces::{module}"), name)
    }

    fn named(&self, module: &str, name: &str) -> String {
        if self.is_unique(name) {
            name.to_owned()
        } else {
            format!("{}::{module}::{name}", self.krate)
        }
    }
}

/// The types and constants of a module, with the structures in shared memory.
pub(super) fn of_types(module: &view::library::Module) -> Vec<String> {
    let mut names = Vec::new();
    for decl in &module.types {
        names.push(names::ty(&decl.name));
        let structures = decl.in_place.iter();
        names.extend(structures.map(|s| in_place::structure_name(&s.path)));
    }
    names.extend(module.constants.iter().map(|c| names::shout(&c.name)));
    names
}
