//! Names and types of a view in C++. A view lists what there is; the templates in `templates/cpp`
//! print it as data, and the headers of `cpp/include` hold the code.

pub(crate) mod component;
mod in_place;
mod library;
mod machine;
pub(crate) mod names;
pub(crate) mod packages;
mod parameters;
pub(crate) mod print;
pub(crate) mod stubs;
mod types;
mod words;

use crate::collisions::{self, Naming};
use crate::python::HOOKS;
use rc_cdsl::Component;
use rc_diagnostics::{Diagnostic, Diagnostics};

/// Members of the context of every component.
const CONTEXT: [&str; 11] = [
    "name",
    "network",
    "state",
    "now",
    "period",
    "set_parameter",
    "set_period",
    "is_stopping",
    "stop",
    "seed",
    "time",
];

/// Reports names that are not possible or not distinct in C++, and features that workers in C++ do
/// not have.
pub(crate) fn check(component: &Component, found: &mut Diagnostics) {
    const NAMING: Naming = Naming {
        language: "C++",
        module: names::own,
        ty: names::own,
        enumerator: names::own,
        member: names::own,
        operation: names::snake,
        parameter: names::own,
        exception: names::own,
    };
    collisions::check(&component.library, &NAMING, found);
    words::check(component, found);
    for collect in &component.collects {
        let handler = names::own(&collect.name.text);
        let members = ["ctx", "machine", "params"];
        if HOOKS.contains(&handler.as_str()) || members.contains(&handler.as_str()) {
            let message = format!("the worker has `{handler}` already");
            let error = Diagnostic::error("name-collision", collect.name.span, message);
            found.push(error.help("give the collection another name"));
        }
    }
    let language = component.language.span;
    if component.viewer.is_some() {
        refuse(found, language, "a window of InnerModel");
    }
    let slots = component.slots.iter();
    let mut fields: Vec<String> = slots.map(|slot| names::snake(&slot.name)).collect();
    fields.extend(CONTEXT.map(str::to_owned));
    for (_, robot) in &component.kinematics {
        let is_module = |module: &rc_idsl::model::Module| module.name.text == robot.text;
        let is_taken = words::is_namespace(&robot.text)
            || fields.contains(&robot.text)
            || component.library.modules.iter().any(is_module);
        if is_taken {
            let message = format!(
                "a robot cannot be called `{}`: C++ or the component has the name already",
                robot.text
            );
            let error = Diagnostic::error("name-collision", robot.span, message);
            found.push(error.help("write another name after `as`"));
        }
        fields.push(robot.text.clone());
    }
    for slot in &component.slots {
        if CONTEXT.contains(&&*names::snake(&slot.name)) {
            let message = format!(
                "a slot cannot be called `{}`: the context of C++ has the name already",
                slot.name
            );
            let error = Diagnostic::error("name-collision", slot.span, message);
            found.push(error.help("name it: `INTERFACE as other`"));
        }
    }
    if let Some(world) = &component.world {
        let message = "workers in C++ do not have a world yet";
        let help = "write this component in Rust or Python, or let it ask a component that has the world, such as `inner_model`";
        let error = Diagnostic::error("not-in-cpp", world.span, message);
        found.push(error.help(help));
    }
}

fn refuse(found: &mut Diagnostics, place: rc_diagnostics::Span, what: &str) {
    let message = format!("workers in C++ do not have {what} yet");
    let help = "write this component in Rust or Python";
    found.push(Diagnostic::error("not-in-cpp", place, message).help(help));
}
