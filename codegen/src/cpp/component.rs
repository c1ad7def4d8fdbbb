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
    slots: Vec<Slot>,
    handlers: Vec<Handler>,
    collected: Vec<Collected>,
    pub(crate) parameters: Option<Parameters>,
    pub(crate) machine: Option<Machine<'a>>,
    dependencies: &'a [view::component::Dependency],
}

/// A slot that sends, or whose values are kept.
#[derive(Debug, Serialize)]
struct Slot {
    /// Text of its comment.
    doc: String,
    index: usize,
    /// The class of its client or publisher, or of the values that it keeps, with its namespace.
    class: String,
    /// The member of the context, and RoboComp's name; empty where RoboComp has none.
    field: String,
    proxy: String,
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
    /// The statements of a new worker.
    body: &'static [&'static str],
}

/// The handler of a collection.
#[derive(Debug, Serialize)]
struct Collected {
    number: usize,
    name: String,
    parameters: String,
}

fn collected(view: &view::Component, number: usize, of: &view::component::Collect) -> Collected {
    let mut taken: Vec<String> = Vec::new();
    for topic in &of.topics {
        let slot = &view.slots[topic.slot];
        let Some(operation) = view
            .interface(slot)
            .map(|of| &of.operations[topic.operation])
        else {
            continue;
        };
        // Two slots may have topics of one name.
        let is_taken = |name: &str| {
            taken
                .iter()
                .any(|other| other.ends_with(&format!(" {name}")))
        };
        let mut name = names::snake(&operation.name);
        if is_taken(&name) {
            name = format!("{}_{name}", names::snake(&slot.name));
        }
        while is_taken(&name) {
            name.push('_');
        }
        taken.push(format!("rc::Fresh<{}> {name}", library::sample(operation)));
    }
    Collected {
        number,
        name: names::own(&of.name),
        parameters: taken.join(", "),
    }
}

/// A slot as the context has it. `None` if the context has none.
fn slot(index: usize, slot: &view::Slot) -> Option<Slot> {
    let (end, proxy) = match slot.role {
        Role::Publishes if slot.sends => ("Publisher", names::proxy(&slot.name, true)),
        Role::Requires if slot.sends => ("Prx", names::proxy(&slot.name, false)),
        _ if slot.keeps_newest() => ("Samples", String::new()),
        _ if slot.serves_latest() => ("Results", String::new()),
        _ => return None,
    };
    let (role, interface) = (slot.role.word(), &slot.interface);
    let doc = match end {
        "Samples" => format!("the newest samples of `{}`", slot.name),
        "Results" => format!("the results that answer queries of `{}`", slot.name),
        _ if slot.optional => {
            format!("{role} `{interface}`, optional: calls throw `rc::NoServer` without a server")
        }
        _ => format!("{role} `{interface}`"),
    };
    Some(Slot {
        doc,
        index,
        class: format!(
            "{}::{}{end}",
            names::own(&slot.module),
            names::own(interface)
        ),
        field: names::snake(&slot.name),
        proxy,
    })
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
                body: match result.as_str() {
                    "void" => &[],
                    _ => &["return {};"],
                },
                result,
                parameters,
                throws: library::exceptions(described),
                doc: view::documentation::of_operation(described, names::own),
            });
        }
    }
    let collects = view.collects.iter().enumerate();
    let kept = slots.filter_map(|(index, of)| slot(index, of));
    Component {
        name: &view.name,
        file: &view.file,
        doc: &view.doc,
        package: crate::names::package(&view.name),
        note: &view.note,
        managed: view.managed,
        headers: library::of(view),
        slots: kept.collect(),
        handlers,
        collected: collects
            .map(|(number, of)| collected(view, number, of))
            .collect(),
        parameters: view.parameters.as_ref().map(parameters::of),
        machine: view.machine.as_ref().map(machine::of),
        dependencies: &view.dependencies,
    }
}
