//! Names and types of Rust for the fakes of a component: what `templates/rust/testing.rs.tera`
//! prints.

use super::exports;
use super::names;
use super::operation_names::{answer_name, bare, error_name, operation_constant, plain};
use super::types;
use crate::view;
use crate::view::documentation;
use crate::view::library as idsl;
use rc_vocabulary::Role;
use serde::Serialize;
use std::collections::BTreeSet;

/// The fakes of a component.
#[derive(Debug, Serialize)]
pub(crate) struct Testing {
    fakes: Vec<Fake>,
    /// Whether a fake is a server, a subscriber.
    calls: bool,
    publishes: bool,
    /// Whether one is that of a slot array.
    arrays: bool,
    /// Whether their types are those of modules.
    uses_types: bool,
}

/// The fake peer of one slot that calls or publishes.
#[derive(Debug, Serialize)]
pub(crate) struct Fake {
    index: usize,
    slot: String,
    /// The field of the context.
    field: String,
    interface: String,
    is_array: bool,
    calls: bool,
    /// The type of the fake server, and of the functions that read what it gets.
    server: String,
    read: String,
    /// The function that replies with default values.
    default: String,
    /// Type that the fake keeps: a call or a sample.
    kept: String,
    /// The module of the interface below `interfaces`.
    module: String,
    operations: Vec<Operation>,
}

#[derive(Debug, Serialize)]
struct Operation {
    name: String,
    doc: Vec<String>,
    variant: String,
    answer: String,
    plain: String,
    constant: String,
    inputs: Vec<Input>,
    two_way: bool,
    throws: bool,
    /// How many values a reply has.
    results: usize,
    /// Return type of an answer, with its arrow; empty if it returns nothing.
    returns: String,
}

#[derive(Debug, Serialize)]
struct Input {
    name: String,
    ty: String,
}

/// One fake for each slot that sends.
pub(super) fn of(view: &view::Component) -> Testing {
    let mut taken = BTreeSet::new();
    let slots = view.slots.iter().enumerate();
    let fakes: Vec<Fake> = slots
        .filter(|(_, slot)| slot.sends)
        .map(|(index, slot)| fake(view, index, slot, &mut taken))
        .collect();
    let uses_types = fakes.iter().flat_map(|fake| &fake.operations).any(|of| {
        let mut inputs = of.inputs.iter();
        of.returns.contains("types::") || inputs.any(|input| input.ty.contains("types::"))
    });
    Testing {
        calls: fakes.iter().any(|fake| fake.calls),
        publishes: fakes.iter().any(|fake| !fake.calls),
        arrays: fakes.iter().any(|fake| fake.is_array),
        uses_types,
        fakes,
    }
}

fn fake(
    view: &view::Component,
    index: usize,
    slot: &view::Slot,
    taken: &mut BTreeSet<String>,
) -> Fake {
    let module = exports::interface_module(view, &slot.module, &slot.interface);
    let calls = slot.role == Role::Requires;
    let base = names::camel(&slot.name);
    let kept = if calls { "Call" } else { "Sample" };
    let interface = view.interface(slot);
    let operations = interface.map_or(&[][..], |interface| &interface.operations);
    let mut variants = BTreeSet::new();
    let operations = operations.iter().map(|of| {
        let variant = names::free(names::camel(&of.name), &mut variants);
        operation(view, &module, of, variant)
    });
    let field = names::snake(&slot.name);
    Fake {
        index,
        slot: slot.name.clone(),
        interface: slot.interface.clone(),
        is_array: slot.is_array,
        calls,
        server: names::free(format!("{base}Fake"), taken),
        read: format!("read_{}", bare(&field)),
        default: format!("default_{}", bare(&field)),
        kept: names::free(format!("{base}{kept}"), taken),
        operations: operations.collect(),
        field,
        module,
    }
}

fn operation(
    view: &view::Component,
    module: &str,
    of: &idsl::Operation,
    variant: String,
) -> Operation {
    let path = |home: &str, name: &str| {
        let home = exports::type_module(view, home);
        format!("types::{home}::{}", names::ty(name))
    };
    let inputs = of.inputs.iter().map(|input| Input {
        name: names::local(&input.name),
        ty: types::member(input, &path),
    });
    let result = of.result.iter().map(|ty| types::owned(ty, &path));
    let outputs = of.outputs.iter().map(|m| types::member(m, &path));
    let results: Vec<String> = result.chain(outputs).collect();
    let result = match results.as_slice() {
        [] => "()".to_owned(),
        [one] => one.clone(),
        _ => format!("interfaces::{module}::{}", answer_name(&of.name)),
    };
    let throws = !of.throws.is_empty();
    let returns = match (throws, results.is_empty()) {
        (true, _) => {
            let error = error_name(&of.name);
            format!(" -> Result<{result}, interfaces::{module}::{error}>")
        }
        (false, true) => String::new(),
        (false, false) => format!(" -> {result}"),
    };
    Operation {
        name: of.name.clone(),
        doc: documentation::of_operation(of, names::local),
        variant,
        answer: format!("on_{}", bare(&names::method(&of.name))),
        plain: plain(&of.name),
        constant: operation_constant(&of.name),
        inputs: inputs.collect(),
        two_way: of.two_way,
        throws,
        results: results.len(),
        returns,
    }
}
