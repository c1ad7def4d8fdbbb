//! The traits of an interface's handlers: one for a single slot and one for a slot array, and the
//! same with values in place where the interface has some.

use super::interface::placed;
use super::operation_names::{answer_name, error_name};
use super::{names, types};
use crate::view::library::{Interface, Operation};
use rc_vocabulary::Role;
use serde::Serialize;
use std::collections::BTreeSet;

/// Names of the prelude that a trait would hide in generated code.
const PRELUDE: [&str; 12] = [
    "Clone",
    "Debug",
    "Deref",
    "Err",
    "Fn",
    "FnMut",
    "FnOnce",
    "From",
    "Ok",
    "PartialEq",
    "Sized",
    "Some",
];

/// A trait of handlers, and those that serve it.
#[derive(Debug, Serialize)]
pub(crate) struct Shape {
    name: String,
    /// The traits that answer requests, and that take samples; empty where there is none.
    serve: String,
    receive: String,
    /// The variable of the member in the functions that serve an array; empty for a single slot.
    member: String,
    in_place: bool,
    /// Whether it is the first one, which has the documentation.
    is_first: bool,
    operations: Vec<Handler>,
}

/// A handler.
#[derive(Debug, Serialize)]
struct Handler {
    /// Its signature.
    head: String,
    /// The arguments of a call, behind the context.
    arguments: String,
    method: String,
    /// The structure of the only parameter in shared memory; else empty.
    sample_in_place: String,
    /// The structure of the reply in shared memory; else empty.
    result_in_place: String,
    result_name: String,
}

/// The values that the handlers of a slot get: whether some are in place.
pub(super) fn is_in_place(interface: &Interface, role: Role) -> bool {
    interface.operations.iter().any(|of| match role {
        Role::SubscribesTo => of.sample_in_place.is_some(),
        Role::Implements | Role::Requires | Role::Publishes => of.result_in_place.is_some(),
    })
}

/// The trait of handlers of this shape. The traits that serve it are called the same, behind
/// `Serve` or `Receive`.
pub(super) fn trait_name(interface: &Interface, in_place: bool, array: bool) -> String {
    let name = names::camel(&interface.name);
    let (place, members) = (
        if in_place { "InPlace" } else { "" },
        if array { "Members" } else { "" },
    );
    let mut name = format!("{name}{place}{members}");
    if names::ty(&name) != name && !in_place || PRELUDE.contains(&name.as_str()) {
        name.push('_');
    }
    let taken = operation_types(interface);
    while taken.contains(&name) {
        name.push('_');
    }
    name
}

/// The types that are named after operations.
fn operation_types(interface: &Interface) -> BTreeSet<String> {
    let base = names::camel(&interface.name);
    let mut taken: BTreeSet<String> = ["Client", "Publisher"]
        .map(|end| format!("{base}{end}"))
        .into();
    for operation in &interface.operations {
        taken.insert(error_name(&operation.name));
        taken.insert(answer_name(&operation.name));
    }
    taken
}

/// The names of all types and traits of an interface's module but its errors.
pub(super) fn own_names(interface: &Interface) -> BTreeSet<String> {
    let mut taken = operation_types(interface);
    for (in_place, array) in [(false, false), (false, true), (true, false), (true, true)] {
        let name = trait_name(interface, in_place, array);
        taken.extend(["", "Serve", "Receive"].map(|begin| format!("{begin}{name}")));
    }
    taken
}

/// The traits of an interface that has operations.
pub(super) fn all(interface: &Interface) -> Vec<Shape> {
    if interface.operations.is_empty() {
        return Vec::new();
    }
    let serves = interface.calls && is_in_place(interface, Role::Implements);
    let receives = interface.topics && is_in_place(interface, Role::SubscribesTo);
    let mut all = Vec::new();
    for in_place in [false, true] {
        let (serves, receives) = if in_place {
            (serves, receives)
        } else {
            (interface.calls, interface.topics)
        };
        if !serves && !receives {
            continue;
        }
        for array in [false, true] {
            all.push(shape(interface, (in_place, array), (serves, receives)));
        }
    }
    all
}

fn shape(
    interface: &Interface,
    (in_place, array): (bool, bool),
    (serves, receives): (bool, bool),
) -> Shape {
    let name = trait_name(interface, in_place, array);
    let mut member = String::new();
    if array {
        "member".clone_into(&mut member);
        let inputs = interface.operations.iter().flat_map(|o| &o.inputs);
        let inputs: BTreeSet<String> = inputs.map(|input| names::local(&input.name)).collect();
        while inputs.contains(&member) {
            member.push('_');
        }
    }
    let trait_of = |there: bool, begin: &str| {
        let name = there.then(|| format!("{begin}{name}"));
        name.unwrap_or_default()
    };
    let operations = interface.operations.iter();
    Shape {
        serve: trait_of(serves, "Serve"),
        receive: trait_of(receives, "Receive"),
        in_place,
        is_first: !in_place && !array,
        operations: operations
            .map(|of| handler(interface, of, (in_place, receives), &member))
            .collect(),
        member,
        name,
    }
}

fn handler(
    interface: &Interface,
    of: &Operation,
    (in_place, receives): (bool, bool),
    member: &str,
) -> Handler {
    let path = types::in_interface(&interface.module);
    // A command is a request: only samples of topics are read in place.
    let sample = of.sample_in_place.as_ref();
    let sample = sample.filter(|_| in_place && receives);
    let result = of.result_in_place.as_ref().filter(|_| in_place);
    let (sample_in_place, result_in_place) = (placed(sample, &path), placed(result, &path));
    let mut parameters = vec!["&mut self".to_owned(), "ctx: &mut C".to_owned()];
    let mut arguments = Vec::new();
    if !member.is_empty() {
        parameters.push(format!("{member}: &rc_middleware::Member"));
        arguments.push(member.to_owned());
    }
    let mut inputs = Vec::new();
    for input in &of.inputs {
        let name = names::local(&input.name);
        let ty = match sample {
            Some(_) => format!("&{sample_in_place}"),
            None => types::member(input, &path),
        };
        parameters.push(format!("{name}: {ty}"));
        let by_reference = if sample.is_some() { "&" } else { "" };
        arguments.push(format!("{by_reference}{name}"));
        inputs.push(name);
    }
    let result_name = result.map(|_| reply_name(of, &inputs)).unwrap_or_default();
    if result.is_some() {
        parameters.push(format!("{result_name}: &mut {result_in_place}"));
        arguments.push(result_name.clone());
    }
    let mut results: Vec<String> = Vec::new();
    if result.is_none() {
        results.extend(of.result.iter().map(|ty| types::owned(ty, &path)));
        results.extend(of.outputs.iter().map(|m| types::member(m, &path)));
    }
    let result = match results.as_slice() {
        [] => "()".to_owned(),
        [one] => one.clone(),
        _ => answer_name(&of.name),
    };
    let throws = !of.throws.is_empty();
    let returns = match (of.two_way, throws) {
        (true, true) => format!(" -> Result<{result}, {}>", error_name(&of.name)),
        (true, false) if result != "()" => format!(" -> {result}"),
        _ => String::new(),
    };
    let method = names::method(&of.name);
    Handler {
        head: format!("fn {method}({}){returns}", parameters.join(", ")),
        arguments: arguments
            .iter()
            .map(|argument| format!(", {argument}"))
            .collect(),
        method,
        sample_in_place,
        result_in_place,
        result_name,
    }
}

/// The variable of a reply in place. A parameter may have this name, too.
pub(super) fn reply_name(of: &Operation, inputs: &[String]) -> String {
    let mut name = match (&of.result, of.outputs.last()) {
        (None, Some(output)) => names::local(&output.name),
        _ => "result".to_owned(),
    };
    if inputs.contains(&name) {
        name.push('_');
    }
    name
}
