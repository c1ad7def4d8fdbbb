//! The tables by which the runtime finds the functions of a worker in Rust.

use super::asynchronous::Asynchronous;
use super::freshness::{self, Freshness};
use super::machine::TRAIT;
use super::slot::Slot;
use super::world;
use crate::view;
use serde::Serialize;

/// Data of `adapter.rs.tera`.
#[derive(Debug, Serialize)]
pub(super) struct Adapter {
    /// Slots that the worker serves, for the first line.
    served: &'static str,
    imports: Vec<&'static str>,
    /// Bounds of the worker: all of them, and without the traits that serve slots.
    bounds: Vec<String>,
    bounds_without_slots: Vec<String>,
    /// The constants of `Dispatch`, and those of `Serving`.
    dispatch: Vec<Constant>,
    serving: Vec<Constant>,
}

/// A constant of a trait of the runtime.
#[derive(Debug, Serialize)]
struct Constant {
    name: &'static str,
    ty: &'static str,
    value: String,
}

impl Constant {
    fn new(name: &'static str, ty: &'static str, value: impl Into<String>) -> Self {
        let value = value.into();
        Self { name, ty, value }
    }

    fn array<T>(
        name: &'static str,
        ty: &'static str,
        all: &[T],
        element: impl Fn(&T) -> String,
    ) -> Self {
        let all: String = all.iter().map(|one| element(one) + ", ").collect();
        Self::new(name, ty, format!("&[{all}]"))
    }
}

pub(super) fn of(
    view: &view::Component,
    slots: &[Slot],
    asynchronous: &[Asynchronous],
    freshness: &Freshness,
) -> Adapter {
    let has_machine = view.machine.is_some();
    let receives = slots.iter().any(|slot| slot.receives);
    let imports = [
        ("crate::asynchronous", !asynchronous.is_empty()),
        ("crate::context::Context", true),
        ("crate::description::DESCRIPTION", true),
        ("crate::interfaces", receives),
        ("crate::machine::StateMachine", has_machine),
        (
            "rc_runtime::{Dispatch, Serving, SlotEntry, WorkerTable}",
            true,
        ),
    ];
    let imports = imports.into_iter().filter(|(_, is_used)| *is_used);
    Adapter {
        served: if has_machine {
            "its slots and its state machine"
        } else {
            "its slots"
        },
        imports: imports.map(|(path, _)| path).collect(),
        bounds: bounds(view, slots, asynchronous),
        bounds_without_slots: bounds(view, &[], asynchronous),
        dispatch: dispatch(view, asynchronous),
        serving: serving(view, slots, freshness),
    }
}

fn dispatch(view: &view::Component, asynchronous: &[Asynchronous]) -> Vec<Constant> {
    let table = if view.managed { "managed" } else { "plain" };
    let mut all = vec![
        Constant::new(
            "DESCRIPTION",
            "&'static rc_runtime::Description",
            "&DESCRIPTION",
        ),
        Constant::new(
            "WORKER",
            "WorkerTable<W, Self>",
            format!("WorkerTable::{table}()"),
        ),
    ];
    if view.machine.is_some() {
        all.push(Constant::new(
            "MACHINE",
            "rc_runtime::MachineTable<W, Self>",
            "crate::machine::table()",
        ));
    }
    if !asynchronous.is_empty() {
        all.push(Constant::array(
            "ENDS",
            "&'static [(usize, rc_runtime::End<W, Self>)]",
            asynchronous,
            |slot| format!("({}, asynchronous::{}::<W>)", slot.index, slot.end),
        ));
    }
    all
}

fn serving(view: &view::Component, slots: &[Slot], freshness: &Freshness) -> Vec<Constant> {
    let mut all = vec![Constant::array(
        "SLOTS",
        "&'static [SlotEntry<W, Self>]",
        slots,
        |slot| slot.entry.clone(),
    )];
    let collects = freshness.tables();
    if !collects.is_empty() {
        all.push(Constant::array(
            "COLLECTS",
            "&'static [rc_runtime::Collect]",
            &collects,
            |(description, _)| description.clone(),
        ));
        all.push(Constant::array(
            "COLLECTED",
            "&'static [rc_runtime::CollectedHandler<W, Self>]",
            &collects,
            |(_, handler)| handler.clone(),
        ));
    }
    if view.world.is_some() {
        all.push(Constant::new(
            "TURN",
            "Option<fn(&mut W, &mut Self) -> bool>",
            "Some(crate::world::turn::<W>)",
        ));
    }
    all
}

/// The traits of the worker, with those that serve `slots`.
fn bounds(view: &view::Component, slots: &[Slot], asynchronous: &[Asynchronous]) -> Vec<String> {
    let worker = if view.managed {
        "rc_runtime::ManagedWorker<Context>"
    } else {
        "rc_runtime::Worker<Context>"
    };
    let mut bounds = vec![worker.to_owned()];
    // A world has slots.
    let has_world = view.world.is_some() && !slots.is_empty();
    let is_whole = !slots.is_empty();
    let slots = slots.iter().filter(|slot| slot.receives);
    bounds.extend(slots.map(|slot| slot.serving.clone()));
    bounds.extend(view.machine.iter().map(|_| TRAIT.to_owned()));
    let ends = asynchronous.iter();
    bounds.extend(ends.map(|slot| format!("asynchronous::{}", slot.handler)));
    if is_whole && !view.collects.is_empty() {
        bounds.push(format!("crate::freshness::{}", freshness::TRAIT));
    }
    if has_world {
        bounds.push(format!("crate::world::{}", world::TRAIT));
    }
    bounds.push("'static".to_owned());
    bounds
}
