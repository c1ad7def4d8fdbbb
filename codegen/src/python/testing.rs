//! Names and types of Python for the fakes of a component: what `templates/python/testing.py.tera`
//! prints.

use super::imports::Imports;
use super::library::Types;
use super::{documentation, interfaces, layout, names, types};
use crate::view;
use crate::view::library::Operation;
use rc_vocabulary::Role;
use serde::Serialize;

/// The fakes of a component.
#[derive(Debug, Serialize)]
pub(crate) struct Testing {
    fakes: Vec<Fake>,
    calls: bool,
    publishes: bool,
    /// Calls that let each fake server answer with default values.
    answers: Vec<String>,
    imports: Imports,
}

/// The fake peer of one slot that calls or publishes.
#[derive(Debug, Serialize)]
struct Fake {
    index: usize,
    field: String,
    interface: String,
    calls: bool,
    is_array: bool,
    /// The class of a fake server; empty for a subscriber.
    class: String,
    /// Its slot, or a member of it, for the comment of the class.
    served: String,
    /// The expression that makes the fake.
    new: String,
    operations: Vec<Answered>,
}

#[derive(Debug, Serialize)]
struct Answered {
    index: usize,
    name: String,
    doc: String,
    /// `def on_name(self, answer: …) -> None:`
    signature: String,
    /// Expression for the default value of a reply; empty if there is none.
    default: String,
}

pub(crate) fn of(view: &view::Component, of: &Types) -> Testing {
    let slots = view.slots.iter().enumerate().filter(|(_, slot)| slot.sends);
    let fakes: Vec<Fake> = slots.map(|(at, slot)| fake(view, at, slot, of)).collect();
    let operations = fakes.iter().flat_map(|fake| &fake.operations);
    let texts = operations.flat_map(|of| [of.signature.as_str(), &of.default]);
    let texts: Vec<&str> = texts.collect();
    let modules = view.modules.iter();
    let modules = modules.map(|module| ("types", "_", names::module(&module.name)));
    let mut stems: Vec<String> = view
        .slots
        .iter()
        .map(|slot| interfaces::stem(view, &slot.module, &slot.interface))
        .collect();
    stems.sort();
    stems.dedup();
    let stems = stems.into_iter().map(|stem| ("interfaces", "_i_", stem));
    let imports = modules.chain(stems).filter_map(|(folder, alias, stem)| {
        layout::mentions(&texts, &format!("{alias}{stem}."))
            .then(|| format!("from .{folder} import {stem} as {alias}{stem}"))
    });
    let mut imports: Vec<String> = imports.collect();
    imports
        .extend(["context import Context", "worker import Worker"].map(|of| format!("from .{of}")));
    imports.extend(
        view.parameters
            .iter()
            .map(|_| "from .parameters import Params".to_owned()),
    );
    imports.sort();
    imports.insert(0, "from . import COMPONENT".to_owned());
    let words = [("_abc.", !texts.is_empty()), ("_testing.", true)];
    let servers = fakes.iter().filter(|fake| fake.calls);
    let answers = servers.map(|fake| {
        if fake.is_array {
            format!(
                "self.{}.each(lambda server: server.answer_defaults())",
                fake.field
            )
        } else {
            format!("self.{}.answer_defaults()", fake.field)
        }
    });
    Testing {
        answers: answers.collect(),
        calls: fakes.iter().any(|fake| fake.calls),
        publishes: fakes.iter().any(|fake| !fake.calls),
        imports: Imports::of(&texts, &words, imports),
        fakes,
    }
}

fn fake(view: &view::Component, index: usize, slot: &view::Slot, of: &Types) -> Fake {
    let calls = slot.role == Role::Requires;
    let stem = interfaces::stem(view, &slot.module, &slot.interface);
    let operations = view.interface(slot).filter(|_| calls);
    let operations = operations.map_or(&[][..], |interface| &interface.operations);
    let operations = operations.iter().enumerate();
    let class = format!("{}Fake", names::class(&slot.name));
    let class = if calls { class } else { String::new() };
    let made = if calls {
        &class
    } else {
        "_testing.FakeSubscriber"
    };
    let (served, new) = if slot.is_array {
        (
            format!("a member of `{}`", slot.name),
            format!("_testing.FakeArray(self.link, {index}, {made})"),
        )
    } else {
        (
            format!("`{}`", slot.name),
            format!("{made}(self.link, {index})"),
        )
    };
    Fake {
        served,
        new,
        index,
        field: names::snake(&slot.name),
        interface: slot.interface.clone(),
        calls,
        is_array: slot.is_array,
        class,
        operations: operations
            .map(|(at, operation)| answered(at, operation, &stem, of))
            .collect(),
    }
}

fn answered(index: usize, of: &Operation, stem: &str, all: &Types) -> Answered {
    let path =
        |module: &str, name: &str| format!("_{}.{}", names::module(module), names::class(name));
    let answer = |class: &str| format!("_i_{stem}.{class}");
    let reply = interfaces::reply(of, &path, &answer);
    let inputs = of.inputs.iter().map(|input| types::member(input, &path));
    let inputs = inputs.collect::<Vec<String>>().join(", ");
    let function = format!("_abc.Callable[[{inputs}], {reply}]");
    let function = match reply.as_str() {
        "None" => function,
        _ => format!("{function} | {reply}"),
    };
    let arguments = ["self".to_owned(), format!("answer: {function}")];
    let head = format!("def on_{}", names::method(&of.name).trim_end_matches('_'));
    let result = of.result.iter().map(|ty| all.default_of_type(ty, &path));
    let outputs = of.outputs.iter();
    let outputs = outputs.map(|output| all.default_of(output, &path));
    let parts: Vec<String> = result.chain(outputs).collect();
    let default = match parts.as_slice() {
        [] => String::new(),
        [one] => match one.as_str() {
            "[]" => "list".to_owned(),
            "{}" => "dict".to_owned(),
            one => format!("lambda: {one}"),
        },
        all => format!("lambda: {reply}({})", all.join(", ")),
    };
    Answered {
        index,
        name: of.name.clone(),
        doc: documentation::docstring(
            8,
            &[format!(
                "Answers `{}` with a value, or with what a function returns.",
                of.name
            )],
        ),
        signature: layout::call(4, &head, &arguments, " -> None:"),
        default,
    }
}
