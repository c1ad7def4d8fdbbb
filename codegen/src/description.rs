//! The description of a component in another language than Rust, which the runtime reads when it
//! starts, and tools read for a component without an executable of its own. Functions have the
//! names of Python, also in messages of the runtime.

use crate::project::Project;
use crate::python::names;
use crate::view;
use crate::view::component::{Slot, Time};
use rc_vocabulary::{Middlewares, Role};
use serde_json::{Value, json};

/// The nesting depth of a slot, a type or a state in a description.
const ROW: usize = 2;

/// The last part of the names of a state's functions.
pub(crate) fn state_suffix(state: &str) -> String {
    names::snake(state).trim_end_matches('_').to_owned()
}

/// The parts that depend on the language of a worker.
pub(crate) struct Guest {
    /// Whether handlers of samples in place get views.
    pub(crate) in_place: bool,
    /// The name of a handler, of its slot and its operation.
    pub(crate) handler: fn(&str, &str) -> String,
    /// The name of the handler of a collection.
    pub(crate) collected: fn(&str) -> String,
}

/// The description of a component for these middlewares. A program that knows its types from there
/// needs no code of it.
///
/// # Errors
/// A type cannot be described.
pub fn describe(
    project: &Project,
    middlewares: impl Into<Middlewares>,
) -> Result<Value, serde_json::Error> {
    let guest = Guest {
        in_place: false,
        handler: |_, operation| operation.to_owned(),
        collected: str::to_owned,
    };
    let (view, _) = view::component::of(project, middlewares);
    serde_json::from_str(&of(&view, &guest)?)
}

/// The text of the description.
pub(crate) fn of(view: &view::Component, guest: &Guest) -> Result<String, serde_json::Error> {
    let types = view.modules.iter();
    let types: Vec<Value> = types
        .map(|module| serde_json::from_str(&module.description))
        .collect::<Result<_, _>>()?;
    let parameters = view.parameters.as_ref();
    let parameters = parameters.map(|parameters| serde_json::from_str::<Value>(&parameters.json));
    let mut all = json!({
        "name": view.name,
        "model": view.hash,
        "middleware": view.middleware,
        "period_ns": nanoseconds(view.period),
        "managed": view.managed,
        "simulates_time": view.simulates_time,
        "parameters": parameters.transpose()?,
        "slots": view.slots.iter().map(|of| slot(view, of, guest)).collect::<Vec<Value>>(),
        "types": types,
    });
    let mut further = view.middlewares.iter().filter(|one| {
        let mut chosen = view.slots.iter().filter_map(|slot| slot.middleware);
        **one != view.middleware && !chosen.any(|of_slot| of_slot == **one)
    });
    if further.clone().next().is_some() {
        all["further_middlewares"] = further.by_ref().map(|one| one.word()).collect();
    }
    if !view.collects.is_empty() {
        let collects = view.collects.iter();
        let collects = collects.map(|collect| {
            let topics = collect.topics.iter();
            let topics = topics.map(|topic| json!([topic.slot, topic.operation]));
            json!({
                "name": collect.name,
                "handler": (guest.collected)(&collect.name),
                "topics": topics.collect::<Vec<Value>>(),
                "within_ns": nanoseconds(collect.within),
            })
        });
        all["collects"] = collects.collect();
    }
    if view.window.is_some() {
        all["window"] = true.into();
    }
    if let Some(machine) = &view.machine {
        all["machine"] = of_machine(machine)?;
    }
    if !view.ros_types.is_empty() {
        all["ros_types"] = view.ros_types.clone().into();
    }
    Ok(rc_configuration::json_text(&all, ROW))
}

fn nanoseconds(time: Time) -> u64 {
    time.seconds
        .saturating_mul(1_000_000_000)
        .saturating_add(time.nanoseconds.into())
}

fn slot(view: &view::Component, slot: &Slot, guest: &Guest) -> Value {
    let operations = view.interface(slot).map_or(&[][..], |i| &i.operations);
    let operations = operations.iter().map(|of| {
        let mut operation = json!({ "name": of.name });
        if slot.receives {
            operation["handler"] = (guest.handler)(&slot.name, &of.name).into();
        }
        let in_place = guest.in_place
            && slot.in_place
            && slot.role == Role::SubscribesTo
            && of.sample_in_place.is_some();
        if in_place {
            operation["in_place"] = true.into();
        }
        operation
    });
    let mut all = json!({
        "name": slot.name,
        "role": slot.role,
        "interface": slot.interface,
        "type_name": format!("{}::{}", slot.module, slot.interface),
        "type_hash": slot.type_hash,
        "middleware": slot.middleware.unwrap_or(view.middleware),
        "qos": slot.qos.0,
        "operations": operations.collect::<Vec<Value>>(),
    });
    if slot.is_array {
        all["is_array"] = true.into();
    }
    if slot.asynchronous {
        all["asynchronous"] = true.into();
    }
    if !slot.external_types.is_empty() {
        all["external_types"] = slot.external_types.clone().into();
    }
    if let Some(machine) = &view.machine
        && !slot.available.is_empty()
    {
        let states = machine.states.iter();
        let states = states.filter(|state| slot.available.contains(&state.name));
        all["available"] = states
            .map(|state| state.number)
            .collect::<Vec<u16>>()
            .into();
    }
    all
}

fn of_machine(machine: &view::Machine) -> Result<Value, serde_json::Error> {
    let last = machine.states.iter().map(|state| state.number).max();
    let mut states = vec![String::new(); usize::from(last.unwrap_or_default()) + 1];
    for state in &machine.states {
        states[usize::from(state.number)] = state_suffix(&state.name);
    }
    let functions = |all: &[String]| {
        all.iter()
            .map(|name| names::snake(name))
            .collect::<Vec<_>>()
    };
    let mut all = json!({
        "chart": serde_json::to_value(&machine.chart)?,
        "external": machine.external,
        "states": states,
        "guards": functions(&machine.guards),
        "actions": functions(&machine.actions),
    });
    // The events that RoboComp's template of a machine fires itself: after the start, and in each
    // period in a state.
    let is_template = machine.name.eq_ignore_ascii_case("defaultMachine");
    let event = |wanted: &str| {
        let mut events = machine.events.iter();
        let at = events.position(|event| event.eq_ignore_ascii_case(wanted));
        at.filter(|_| is_template)
    };
    if let Some(first) = event("InitializeToCompute") {
        all["first_event"] = first.into();
    }
    let compute = machine
        .states
        .iter()
        .find(|s| s.name.eq_ignore_ascii_case("compute"));
    if let (Some(event), Some(state)) = (event("ComputeToCompute"), compute) {
        all["period_event"] = event.into();
        all["period_state"] = state.number.into();
    }
    Ok(all)
}
