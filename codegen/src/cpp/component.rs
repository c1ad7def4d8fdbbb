//! Names and types of C++ for a component, for the templates.

use super::library::{self, Header};
use super::machine::{self, Machine};
use super::names;
use super::parameters::{self, Parameters};
use crate::view;
use rc_vocabulary::Role;
use serde::Serialize;

/// A component as its templates see it.
#[derive(Debug, Serialize)]
pub(crate) struct Component<'a> {
    name: &'a str,
    file: &'a str,
    doc: &'a [String],
    /// The name of the program.
    package: String,
    /// The note, as the content of a text.
    note: &'a str,
    managed: bool,
    pub(crate) headers: Vec<Header>,
    slots: Vec<Slot<'a>>,
    handlers: Vec<Handler>,
    pub(crate) parameters: Option<Parameters>,
    pub(crate) machine: Option<Machine<'a>>,
    dependencies: &'a [view::component::Dependency],
}

/// A slot that sends.
#[derive(Debug, Serialize)]
struct Slot<'a> {
    role: &'a str,
    interface: &'a str,
    index: usize,
    /// The class of its client or publisher, with its namespace.
    class: String,
    /// The member of the context, and RoboComp's name.
    field: String,
    proxy: String,
    optional: bool,
}

#[derive(Debug, Serialize)]
struct Handler {
    slot: usize,
    operation: usize,
    name: String,
    result: String,
    parameters: String,
    /// `<E1, E2>`, the exceptions that it may throw.
    throws: String,
    doc: Vec<String>,
    /// A body for a new worker.
    is_void: bool,
}

pub(crate) fn of(view: &view::Component) -> Component<'_> {
    let slots = view.slots.iter().enumerate();
    let mut handlers = Vec::new();
    for (slot, of) in slots.clone().filter(|(_, slot)| slot.receives) {
        let operations = view
            .interface(of)
            .map_or(&[][..], |interface| &interface.operations);
        for (operation, described) in operations.iter().enumerate() {
            let (result, parameters) = library::signature(described);
            handlers.push(Handler {
                slot,
                operation,
                name: names::handler(&of.name, &described.name),
                is_void: result == "void",
                result,
                parameters,
                throws: library::exceptions(described),
                doc: view::documentation::of_operation(described, names::own),
            });
        }
    }
    let sending = slots.filter(|(_, slot)| slot.sends).map(|(index, slot)| {
        let publishes = slot.role == Role::Publishes;
        let end = if publishes { "Publisher" } else { "Prx" };
        Slot {
            role: slot.role.word(),
            interface: &slot.interface,
            index,
            class: format!(
                "{}::{}{end}",
                names::own(&slot.module),
                names::own(&slot.interface)
            ),
            field: names::snake(&slot.name),
            proxy: names::proxy(&slot.name, publishes),
            optional: slot.optional,
        }
    });
    Component {
        name: &view.name,
        file: &view.file,
        doc: &view.doc,
        package: crate::names::package(&view.name),
        note: &view.note,
        managed: view.managed,
        headers: library::of(view),
        slots: sending.collect(),
        handlers,
        parameters: view.parameters.as_ref().map(parameters::of),
        machine: view.machine.as_ref().map(machine::of),
        dependencies: &view.dependencies,
    }
}
