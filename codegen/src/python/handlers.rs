//! The functions of the worker that serve its slots and its state machine.

use super::layout;
use super::{documentation, interfaces, library, names, types};
use crate::view;
use crate::view::library::{Interface, Operation};
use rc_vocabulary::Role;
use serde::Serialize;
use std::collections::BTreeMap;

/// The class of a member of a slot array.
const MEMBER: &str = "Member";

/// One function of the worker.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Handler {
    pub(crate) name: String,
    /// `def name(self, ctx: Context) -> None:`, on as many lines as it needs.
    pub(crate) signature: String,
    doc: String,
    /// Result of an unwritten handler; empty for nothing.
    placeholder: String,
    /// Names of the package that the signature mentions.
    #[serde(skip)]
    pub(crate) mentioned: Vec<String>,
    /// The names of the parameters after `self`.
    pub(crate) parameters: Vec<String>,
    /// Their types, and that of the result.
    #[serde(skip)]
    pub(crate) types: Vec<String>,
}

/// The function of the worker that serves an operation of a slot.
pub(crate) fn name(slot: &str, operation: &str) -> String {
    let word = |name: &str| names::snake(name).trim_end_matches('_').to_owned();
    format!("{}_{}", word(slot), word(operation))
}

/// The handlers of a slot, as the base class declares them.
pub(crate) fn of(view: &view::Component, slot: &view::Slot, interface: &Interface) -> Vec<Handler> {
    let path =
        |module: &str, name: &str| format!("_{}.{}", names::module(module), names::class(name));
    let stem = interfaces::stem(view, &slot.module, &slot.interface);
    let answer = |class: &str| format!("_i_{stem}.{class}");
    let operations = interface.operations.iter();
    operations
        .map(|of| handler(view, slot, of, &path, &answer, &|text| text))
        .collect()
}

/// The handlers as the user's file writes them, with names that the package exports.
pub(crate) fn of_user(
    view: &view::Component,
    slot: &view::Slot,
    interface: &Interface,
    unique: &BTreeMap<String, String>,
) -> Vec<Handler> {
    let path = |module: &str, name: &str| {
        let (module, name) = (
            format!("types.{}", names::module(module)),
            names::class(name),
        );
        exported(unique, &module, &name)
    };
    let stem = interfaces::stem(view, &slot.module, &slot.interface);
    let answer = |class: &str| exported(unique, &format!("interfaces.{stem}"), class);
    let operations = interface.operations.iter().map(|of| {
        let mut handler = handler(view, slot, of, &path, &answer, &bare);
        handler.mentioned = mentioned(&handler.signature, unique);
        handler
            .mentioned
            .extend(slot.is_array.then(|| MEMBER.to_owned()));
        handler
    });
    operations.collect()
}

/// A name of a module of the package: alone, if the package exports it.
fn exported(unique: &BTreeMap<String, String>, module: &str, name: &str) -> String {
    if unique.get(name).is_some_and(|from| *from == module) {
        name.to_owned()
    } else {
        format!("{module}.{name}")
    }
}

/// An annotation with the imports of the user's file.
#[expect(clippy::needless_pass_by_value, reason = "one of two ways to write")]
fn bare(text: String) -> String {
    let text = text.replace("_npt.", "npt.").replace("_np.", "np.");
    text.replace("_robocomp.", "")
}

/// The names of the package that a signature of the user's file mentions.
fn mentioned(signature: &str, unique: &BTreeMap<String, String>) -> Vec<String> {
    let words = signature.split(|c: char| !(c.is_alphanumeric() || c == '_' || c == '.'));
    let known = words.filter_map(|word| match word.split_once('.') {
        Some((folder @ ("types" | "interfaces"), _)) => Some(folder),
        _ => unique.contains_key(word).then_some(word),
    });
    known.map(str::to_owned).collect()
}

fn handler(
    view: &view::Component,
    slot: &view::Slot,
    of: &Operation,
    path: types::Path,
    answer: &dyn Fn(&str) -> String,
    write: &dyn Fn(String) -> String,
) -> Handler {
    let sample = of.sample_in_place.as_ref();
    let sample = sample.filter(|_| slot.in_place && slot.role == Role::SubscribesTo);
    let mut arguments = vec!["self".to_owned(), "ctx: Context".to_owned()];
    let mut parameters = vec!["ctx".to_owned()];
    let mut all = vec!["Context".to_owned()];
    if slot.is_array {
        let (name, ty) = (member_name(of), write(format!("_robocomp.{MEMBER}")));
        arguments.push(format!("{name}: {ty}"));
        parameters.push(name);
        all.push(ty);
    }
    for input in &of.inputs {
        let ty = match sample {
            Some(ty) => library::in_place(view, ty, path, "View"),
            None => types::member(input, path),
        };
        let (name, ty) = (names::parameter(&input.name), write(ty));
        arguments.push(format!("{name}: {ty}"));
        parameters.push(name);
        all.push(ty);
    }
    let result = write(interfaces::reply(of, path, answer));
    all.push(result.clone());
    let name = name(&slot.name, &of.name);
    let head = format!("def {name}");
    Handler {
        signature: layout::call(4, &head, &arguments, &format!(" -> {result}:")),
        doc: documentation::of_operation(of),
        placeholder: String::new(),
        mentioned: Vec::new(),
        parameters,
        types: all,
        name,
    }
}

/// The handler of a collection, as the base class declares it.
pub(crate) fn of_collect(view: &view::Component, of: &view::component::Collect) -> Handler {
    let path =
        |module: &str, name: &str| format!("_{}.{}", names::module(module), names::class(name));
    collected(view, of, &path, &|text| text)
}

/// The handler of a collection, as the user's file writes it.
pub(crate) fn of_user_collect(
    view: &view::Component,
    of: &view::component::Collect,
    unique: &BTreeMap<String, String>,
) -> Handler {
    let path = |module: &str, name: &str| {
        let (module, name) = (
            format!("types.{}", names::module(module)),
            names::class(name),
        );
        exported(unique, &module, &name)
    };
    let mut handler = collected(view, of, &path, &bare);
    handler.mentioned = mentioned(&handler.signature, unique);
    handler.mentioned.push("Fresh".to_owned());
    handler
}

fn collected(
    view: &view::Component,
    of: &view::component::Collect,
    path: types::Path,
    write: &dyn Fn(String) -> String,
) -> Handler {
    let mut arguments = vec!["self".to_owned(), "ctx: Context".to_owned()];
    let mut parameters = vec!["ctx".to_owned()];
    let mut all = vec!["Context".to_owned()];
    for topic in &of.topics {
        let slot = &view.slots[topic.slot];
        let Some(operation) = view
            .interface(slot)
            .map(|of| &of.operations[topic.operation])
        else {
            continue;
        };
        let ty = write(interfaces::sample_type(operation, path));
        // Two slots may have topics of one name.
        let mut name = names::parameter(&operation.name);
        if parameters.contains(&name) {
            name = self::name(&slot.name, &operation.name);
        }
        while parameters.contains(&name) {
            name.push('_');
        }
        arguments.push(format!("{name}: {ty}"));
        parameters.push(name);
        all.push(ty);
    }
    all.push("None".to_owned());
    let name = collection(&of.name);
    Handler {
        signature: layout::call(4, &format!("def {name}"), &arguments, " -> None:"),
        doc: "\"\"\"One sample of each topic, whose times are near enough.\"\"\"".to_owned(),
        placeholder: String::new(),
        mentioned: Vec::new(),
        parameters,
        types: all,
        name,
    }
}

/// The function of the worker that handles a collection.
pub(crate) fn collection(name: &str) -> String {
    names::method(name)
}

/// The parameter for the member of a slot array. An input may have this name, too.
fn member_name(of: &Operation) -> String {
    let mut name = "member".to_owned();
    while of.inputs.iter().any(|i| names::parameter(&i.name) == name) {
        name.push('_');
    }
    name
}

/// A function of every worker of this component, with its parameters after `ctx`.
pub(crate) fn of_hook(name: &str, more: &[(&str, &str)]) -> Handler {
    let mut parameters = vec!["ctx".to_owned()];
    let mut types = vec!["Context".to_owned()];
    let mut arguments = vec!["self".to_owned(), "ctx: Context".to_owned()];
    for (name, ty) in more {
        parameters.push((*name).to_owned());
        types.push((*ty).to_owned());
        arguments.push(format!("{name}: {ty}"));
    }
    types.push("None".to_owned());
    Handler {
        signature: layout::call(4, &format!("def {name}"), &arguments, " -> None:"),
        doc: String::new(),
        placeholder: String::new(),
        mentioned: Vec::new(),
        parameters,
        types,
        name: name.to_owned(),
    }
}

/// The functions that a worker must write for its state machine.
pub(crate) fn of_machine(machine: &view::Machine) -> Vec<Handler> {
    let function = |name: &String, result: &str, placeholder: &str| {
        let name = names::snake(name);
        Handler {
            signature: format!("def {name}(self, ctx: Context) -> {result}:"),
            doc: format!("\"\"\"The function `{name}` of the state machine.\"\"\""),
            placeholder: placeholder.to_owned(),
            mentioned: Vec::new(),
            parameters: vec!["ctx".to_owned()],
            types: vec!["Context".to_owned(), result.to_owned()],
            name,
        }
    };
    let guards = machine
        .guards
        .iter()
        .map(|name| function(name, "bool", "True"));
    let actions = machine
        .actions
        .iter()
        .map(|name| function(name, "None", ""));
    guards.chain(actions).collect()
}
