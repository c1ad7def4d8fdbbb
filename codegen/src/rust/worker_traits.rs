//! The traits that the worker of a component implements: those of the slots that receive, of the
//! state machine, and of the ends of started calls.

use super::asynchronous::Asynchronous;
use super::exports::Exports;
use super::freshness::{self, Freshness};
use super::handlers::{Handler, Handlers};
use super::machine::{self, TRAIT};
use super::slot::Slot;
use crate::view;
use serde::Serialize;

/// A trait that the worker implements.
#[derive(Debug, Serialize)]
pub(crate) struct WorkerTrait {
    pub(crate) name: String,
    /// Its arguments where it is implemented.
    pub(crate) generics: String,
    /// The functions that the worker must have.
    pub(crate) operations: Vec<Handler>,
    /// The functions that it may leave out.
    #[serde(skip)]
    pub(crate) optional: Vec<Handler>,
    /// The slot whose handlers it has.
    #[serde(skip)]
    pub(crate) slot: Option<Served>,
}

impl WorkerTrait {
    /// A trait of functions that the worker must have, and that belong to no slot.
    fn of_functions(name: &str, operations: Vec<Handler>) -> Self {
        Self {
            name: name.to_owned(),
            generics: String::new(),
            operations,
            optional: Vec::new(),
            slot: None,
        }
    }
}

/// The slot of a trait of handlers.
#[derive(Debug)]
pub(crate) struct Served {
    /// The index in the component.
    pub(crate) index: usize,
    /// The type that distinguishes it from an earlier slot with the same trait; empty for the first
    /// one.
    pub(crate) marker: String,
    /// The trait that a worker implements instead if a value of its own serves the slot.
    pub(crate) serving: String,
}

/// All of them: those of slots first.
pub(super) fn all(
    view: &view::Component,
    slots: &[Slot],
    asynchronous: &mut [Asynchronous],
    freshness: &mut Freshness,
    exports: &Exports,
) -> Vec<WorkerTrait> {
    let slots = slots.iter().zip(&view.slots).enumerate();
    let slots = slots.filter(|(_, (slot, _))| slot.receives);
    let of_slots = slots.map(|(index, (slot, of))| {
        let handlers = Handlers {
            slot: of,
            module: &slot.module,
            exports,
        };
        let interface = view.interface(of);
        WorkerTrait {
            name: slot.type_name.clone(),
            generics: slot.generics(),
            operations: interface.map_or_else(Vec::new, |interface| handlers.all(interface)),
            optional: Vec::new(),
            slot: Some(Served {
                index,
                marker: slot.marker.clone(),
                serving: slot.serving_trait(),
            }),
        }
    });
    let machines = view.machine.iter();
    let of_machine =
        machines.map(|machine| WorkerTrait::of_functions(TRAIT, machine::functions(machine)));
    let of_ends = asynchronous.iter_mut().map(|slot| WorkerTrait {
        name: slot.handler.clone(),
        generics: String::new(),
        operations: Vec::new(),
        optional: std::mem::take(&mut slot.handlers),
        slot: None,
    });
    let collected = freshness.take_handlers();
    let of_collected =
        (!collected.is_empty()).then(|| WorkerTrait::of_functions(freshness::TRAIT, collected));
    let all = of_slots.chain(of_machine).chain(of_ends);
    all.chain(of_collected).collect()
}
