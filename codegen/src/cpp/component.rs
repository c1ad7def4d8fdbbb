//! Names and types of C++ for a component, for the templates.

use super::library::{self, Header};
use super::machine::{self, Machine};
use super::names;
use super::parameters::{self, Parameters};
use crate::collisions;
use crate::kinematics::Kinematics;
use crate::view;
use rc_vocabulary::Role;
use serde::Serialize;
use std::collections::BTreeSet;

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
    simulates_time: bool,
    /// The solvers of robots, each in a header with a namespace of its name.
    pub(crate) kinematics: Vec<Kinematics<'a>>,
    /// The class of Qt that the worker is, if it is a window.
    pub(crate) window: Option<&'static str>,
    pub(crate) headers: Vec<Header>,
    slots: Vec<Slot>,
    handlers: Vec<Handler>,
    /// The ends of started calls.
    ended: Vec<library::Ended>,
    /// The interfaces of the fakes of a test, and those of its slots.
    fake_servers: Vec<Fake>,
    fake_subscribers: Vec<Fake>,
    fakes: Vec<FakeSlot>,
    /// The operations that the worker can name in a pattern of communication.
    pub(crate) patterns: BTreeSet<String>,
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
    /// The class of its client or publisher, or of the values that it keeps, with its namespace; of a
    /// member, if it is an array.
    class: String,
    /// The type of the member of the context.
    ty: String,
    /// The member of the context, and RoboComp's name; empty where RoboComp has none.
    field: String,
    proxy: String,
    /// The object of the paper's patterns: `speechcomm`.
    pattern: String,
}

/// The class of the fake peers of an interface.
#[derive(Debug, Serialize)]
struct Fake {
    name: String,
    ends: library::Ends,
}

/// The fake peer of a slot that sends.
#[derive(Debug, Serialize)]
struct FakeSlot {
    index: usize,
    /// The member of the `TestContext`, and its type.
    field: String,
    ty: String,
    /// The expression that names one peer in a test.
    peer: String,
    interface: String,
    calls: bool,
}

#[derive(Clone, Debug, Serialize)]
pub(super) struct Handler {
    slot: usize,
    operation: usize,
    pub(super) name: String,
    pub(super) result: String,
    pub(super) parameters: String,
    /// Those of the definition of a new worker, which does not use them yet.
    pub(super) unused: String,
    /// `<E1, E2>`, the exceptions that it may throw.
    throws: String,
    doc: Vec<String>,
    /// The statements of a new worker.
    pub(super) body: &'static [&'static str],
}

/// The statements of a new function with this result.
fn body(result: &str) -> &'static [&'static str] {
    match result {
        "void" => &[],
        _ => &["return {};"],
    }
}

/// Parameters without a warning of the compiler if the function does not use them.
fn unused(parameters: &str) -> String {
    let mut depth = 0_i32;
    let is_end = |c: char| {
        depth += i32::from(c == '<') - i32::from(c == '>');
        c == ',' && depth == 0
    };
    let each = parameters.split(is_end).map(str::trim);
    let each = each.filter(|parameter| !parameter.is_empty());
    let marked: Vec<String> = each.map(|of| format!("[[maybe_unused]] {of}")).collect();
    marked.join(", ")
}

impl Handler {
    /// A function of the worker that handles no operation.
    fn other(result: &str, name: &str, parameters: &str) -> Self {
        Self {
            slot: 0,
            operation: 0,
            name: name.to_owned(),
            result: result.to_owned(),
            parameters: parameters.to_owned(),
            unused: unused(parameters),
            throws: String::new(),
            doc: Vec::new(),
            body: body(result),
        }
    }
}

impl Component<'_> {
    /// The functions that a worker has to have.
    pub(super) fn functions(&self) -> Vec<Handler> {
        let collected = self.collected.iter();
        let collected = collected.map(|of| Handler::other("void", &of.name, &of.parameters));
        let machine = self.machine.iter();
        let machine = machine.flat_map(|machine| {
            let guards = machine
                .guards
                .iter()
                .map(|of| Handler::other("bool", &of.name, ""));
            let actions = machine.actions.iter();
            guards.chain(actions.map(|of| Handler::other("void", &of.name, "")))
        });
        let handlers = self.handlers.iter().cloned();
        handlers.chain(collected).chain(machine).collect()
    }
}

/// The handler of a collection.
#[derive(Debug, Serialize)]
struct Collected {
    number: usize,
    name: String,
    parameters: String,
    unused: String,
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
    let parameters = taken.join(", ");
    Collected {
        number,
        name: names::own(&of.name),
        unused: unused(&parameters),
        parameters,
    }
}

/// A slot as the context has it. `None` if the context has none.
fn slot(index: usize, slot: &view::Slot) -> Option<Slot> {
    let (end, proxy) = match slot.role {
        Role::Publishes if slot.sends => ("Publisher", names::proxy(&slot.name, true)),
        Role::Requires if slot.asynchronous => ("AsyncPrx", names::proxy(&slot.name, false)),
        Role::Requires if slot.sends => ("Prx", names::proxy(&slot.name, false)),
        _ if slot.is_array => ("", String::new()),
        _ if slot.keeps_newest() => ("Samples", String::new()),
        _ if slot.serves_latest() => ("Results", String::new()),
        _ => return None,
    };
    let (role, interface) = (slot.role.word(), &slot.interface);
    let doc = match end {
        "Samples" => format!("the newest samples of `{}`", slot.name),
        "Results" => format!("the results that answer queries of `{}`", slot.name),
        _ if slot.is_array => format!("{role} `{interface}`, whose members `initialize` opens"),
        _ if slot.optional => {
            format!("{role} `{interface}`, optional: calls throw `rc::NoServer` without a server")
        }
        _ => format!("{role} `{interface}`"),
    };
    let (module, name) = (names::own(&slot.module), names::own(interface));
    let class = format!("{module}::{name}{end}");
    Some(Slot {
        doc,
        index,
        ty: match (slot.is_array, end) {
            (true, "") => "rc::Members".to_owned(),
            (true, _) => format!("rc::Array<{class}>"),
            (false, _) => class.clone(),
        },
        class,
        field: names::snake(&slot.name),
        pattern: format!("{}comm", slot.name.to_lowercase()),
        proxy: if slot.is_array { String::new() } else { proxy },
    })
}

/// The members of every `TestContext`.
const TEST_FUNCTIONS: [&str; 10] = [
    "advance",
    "end_calls",
    "list_members",
    "params",
    "requested_parameters",
    "run",
    "set_state",
    "set_time",
    "start",
    "transition",
];

/// The class of the fake peers of an interface: two modules may have one name.
fn fake_name(view: &view::Component, slot: &view::Slot) -> String {
    let end = if slot.role == Role::Publishes {
        "Subscriber"
    } else {
        "Server"
    };
    let mut slots = view.slots.iter();
    let is_taken = slots.any(|other| {
        other.sends && other.interface == slot.interface && other.module != slot.module
    });
    let module = if is_taken {
        names::own(&slot.module)
    } else {
        String::new()
    };
    format!("Fake{module}{}{end}", slot.interface)
}

/// The classes of fakes for slots of a role, one of each interface.
fn fakes(view: &view::Component, role: Role) -> Vec<Fake> {
    let mut done: Vec<Fake> = Vec::new();
    for slot in view
        .slots
        .iter()
        .filter(|slot| slot.sends && slot.role == role)
    {
        let name = fake_name(view, slot);
        if let Some(interface) = view.interface(slot)
            && done.iter().all(|other| other.name != name)
        {
            done.push(Fake {
                name,
                ends: library::ends(view, interface),
            });
        }
    }
    done
}

fn fake_slot(
    view: &view::Component,
    index: usize,
    slot: &view::Slot,
    taken: &mut BTreeSet<String>,
) -> FakeSlot {
    let (class, field) = (
        fake_name(view, slot),
        collisions::free(names::snake(&slot.name), taken),
    );
    let (ty, peer) = if slot.is_array {
        (
            format!("rc::FakeArray<{class}>"),
            format!("test.{field}.member(NAME)"),
        )
    } else {
        (class, format!("test.{field}"))
    };
    FakeSlot {
        index,
        field,
        ty,
        peer,
        interface: names::own(&slot.interface),
        calls: slot.role == Role::Requires,
    }
}

pub(crate) fn of(view: &view::Component) -> Component<'_> {
    let slots = view.slots.iter().enumerate();
    let mut handlers = Vec::new();
    for (slot, of) in slots.clone().filter(|(_, slot)| slot.receives) {
        let operations = view
            .interface(of)
            .map_or(&[][..], |interface| &interface.operations);
        for (operation, described) in operations.iter().enumerate() {
            let (result, parameters) = library::signature(view, of, described);
            handlers.push(Handler {
                slot,
                operation,
                name: names::handler(&of.name, &described.name),
                body: body(&result),
                result,
                unused: unused(&parameters),
                parameters,
                throws: library::exceptions(described),
                doc: view::documentation::of_operation(described, names::own),
            });
        }
    }
    let interfaces = slots.clone();
    let interfaces = interfaces.filter_map(|(at, of)| Some((at, of, view.interface(of)?)));
    let ended = interfaces.flat_map(|(at, slot, of)| library::ended(at, slot, of));
    let fake_slots = slots.clone().filter(|(_, slot)| slot.sends);
    let single = slots.clone().filter(|(_, of)| of.sends && !of.is_array);
    let single = single.filter_map(|(_, of)| view.interface(of));
    let patterns = single.flat_map(|of| &of.operations);
    let patterns = patterns.map(|of| names::own(&of.name)).collect();
    let mut taken: BTreeSet<String> = TEST_FUNCTIONS.map(str::to_owned).into();
    let collects = view.collects.iter().enumerate();
    let kept = slots.filter_map(|(index, of)| slot(index, of));
    Component {
        name: &view.name,
        file: &view.file,
        doc: &view.doc,
        package: crate::names::package(&view.name),
        note: &view.note,
        managed: view.managed,
        simulates_time: view.simulates_time,
        kinematics: view
            .kinematics
            .iter()
            .map(|robot| Kinematics::of(robot, robot.name.clone(), &robot.cpp))
            .collect(),
        window: view.window,
        headers: library::of(view),
        slots: kept.collect(),
        handlers,
        ended: ended.collect(),
        patterns,
        fake_servers: fakes(view, Role::Requires),
        fake_subscribers: fakes(view, Role::Publishes),
        fakes: fake_slots
            .map(|(index, slot)| fake_slot(view, index, slot, &mut taken))
            .collect(),
        collected: collects
            .map(|(number, of)| collected(view, number, of))
            .collect(),
        parameters: view.parameters.as_ref().map(parameters::of),
        machine: view.machine.as_ref().map(machine::of),
        dependencies: &view.dependencies,
    }
}

#[cfg(test)]
mod tests {
    use super::unused;

    #[test]
    fn each_parameter_of_a_new_function_may_be_unused() {
        let parameters = "const std::map<int, std::vector<A>>& all, B& out";
        let expected =
            "[[maybe_unused]] const std::map<int, std::vector<A>>& all, [[maybe_unused]] B& out";
        assert_eq!(unused(parameters), expected);
        assert_eq!(unused(""), "");
    }
}
