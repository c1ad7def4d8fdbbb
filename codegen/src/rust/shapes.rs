//! The lists of an interface's operations, over which `rc_middleware` declares the traits of handlers
//! and those that serve them: one list for owned values, and one for values in place where the
//! interface has some.

use super::codecs::placed;
use super::operation;
use super::operation_names::{answer_name, error_name};
use super::{names, those, types};
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

/// A list of operations.
#[derive(Debug, Serialize)]
pub(crate) struct Shape {
    /// The macro with the list, and what its documentation says of its values.
    list: &'static str,
    values: &'static str,
    /// The traits of handlers, of those that answer requests, and of those that take samples.
    single: Traits,
    members: Traits,
    /// The macros that get the list.
    uses: Vec<&'static str>,
    handlers: Vec<Handler>,
}

/// The traits for a slot, or for a slot array.
#[derive(Debug, Serialize)]
struct Traits {
    handlers: String,
    serve: String,
    receive: String,
}

impl Traits {
    fn of(interface: &Interface, in_place: bool, array: bool) -> Self {
        let handlers = trait_name(interface, in_place, array);
        Self {
            serve: format!("Serve{handlers}"),
            receive: format!("Receive{handlers}"),
            handlers,
        }
    }
}

/// A handler.
#[derive(Debug, Serialize)]
struct Handler {
    doc: Vec<String>,
    constant: String,
    /// Its signature, as `rc_middleware::operations` documents it.
    head: String,
    /// The function that serves it, with its codecs.
    how: String,
    /// The fake's list of it; empty for values in place.
    fake: String,
}

/// The values that the handlers of a slot get: whether some are in place.
pub(super) fn is_in_place(interface: &Interface, role: Role) -> bool {
    interface.operations.iter().any(|of| match role {
        Role::SubscribesTo => of.sample_in_place.is_some(),
        Role::Implements | Role::Requires | Role::Publishes => of.result_in_place.is_some(),
    })
}

/// The trait of handlers of this shape. The traits that serve it have its name, after `Serve` or
/// `Receive`.
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

/// The lists of an interface with these operations.
pub(super) fn all(interface: &Interface, operations: &[operation::Operation]) -> Vec<Shape> {
    let shape = |in_place: bool, serves: bool, receives: bool| {
        let of = interface.operations.iter().zip(operations);
        let handlers = of.map(|(of, named)| handler(of, named, in_place, receives));
        Shape {
            list: if in_place {
                "interface_in_place"
            } else {
                "interface"
            },
            values: if in_place {
                ", with values in place"
            } else {
                ""
            },
            single: Traits::of(interface, in_place, false),
            members: Traits::of(interface, in_place, true),
            uses: those(&[
                ("rc_middleware::operations", !in_place),
                ("rc_middleware::handlers", serves || receives),
                ("rc_middleware::serve", serves),
                ("rc_middleware::receive", receives),
            ]),
            handlers: handlers.collect(),
        }
    };
    let is_empty = interface.operations.is_empty();
    let (serves, receives) = (interface.calls, interface.topics);
    let mut all = vec![shape(false, serves && !is_empty, receives && !is_empty)];
    let serves = serves && is_in_place(interface, Role::Implements);
    let receives = receives && is_in_place(interface, Role::SubscribesTo);
    if serves || receives {
        all.push(shape(true, serves, receives));
    }
    all
}

fn handler(
    of: &Operation,
    named: &operation::Operation,
    in_place: bool,
    receives: bool,
) -> Handler {
    let path = types::in_crate();
    // A command is a request: only samples of topics are read in place.
    let sample = of.sample_in_place.as_ref();
    let sample = placed(sample.filter(|_| in_place && receives), &path);
    let reply = placed(of.result_in_place.as_ref().filter(|_| in_place), &path);
    let inputs = of.inputs.iter().map(|input| names::local(&input.name));
    let inputs: Vec<String> = inputs.collect();
    let parameters = of.inputs.iter().zip(&inputs).map(|(input, name)| {
        if sample.is_empty() {
            format!("{name}: {}", types::member(input, &path))
        } else {
            format!("{name}: &{sample}")
        }
    });
    let parameters: Vec<String> = parameters.collect();
    let mut head = format!("fn {}", names::method(&of.name));
    if !parameters.is_empty() {
        head += &format!("({})", parameters.join(", "));
    }
    if !reply.is_empty() {
        head += &format!(" into({}: &mut {reply})", reply_name(of, &inputs));
    }
    let mut results: Vec<String> = Vec::new();
    if reply.is_empty() {
        results.extend(of.result.iter().map(|ty| types::owned(ty, &path)));
        results.extend(of.outputs.iter().map(|m| types::member(m, &path)));
    }
    let result = match results.as_slice() {
        [] => "()".to_owned(),
        [one] => one.clone(),
        _ => answer_name(&of.name),
    };
    let throws = !of.throws.is_empty();
    if throws {
        head += &format!(" -> Result<{result}, {}>", error_name(&of.name));
    } else if result != "()" {
        head += &format!(" -> {result}");
    }
    let try_ = if throws { "try_" } else { "" };
    let (read, write) = (&named.codecs.read, &named.codecs.reply);
    let how = if !sample.is_empty() {
        format!("in_place(rc_middleware::Reader::in_place::<{sample}>)")
    } else if !reply.is_empty() {
        format!("{try_}answer_in_place({read})")
    } else if of.two_way {
        format!("{try_}answer({read}, {write})")
    } else {
        format!("command({read})")
    };
    Handler {
        doc: named.doc.clone(),
        constant: named.constant.clone(),
        head,
        how,
        fake: if in_place {
            String::new()
        } else {
            named.fake.clone()
        },
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
