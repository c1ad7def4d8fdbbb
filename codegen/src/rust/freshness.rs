//! Names and types of Rust for values that know their age: what `templates/rust/freshness.rs.tera`
//! prints.

use super::exports::{self, Exports};
use super::handlers::Handler;
use super::operation::{self, Operation};
use super::{names, types};
use crate::collisions::{bare, free};
use crate::view;
use crate::view::types::Named;
use rc_vocabulary::Role;
use serde::Serialize;
use std::collections::BTreeSet;

/// The trait that handles what is collected.
pub(super) const TRAIT: &str = "Collecting";

/// Data of the module.
#[derive(Debug, Serialize)]
pub(crate) struct Freshness {
    kept: Vec<Values>,
    latest: Vec<Values>,
    collects: Vec<Collect>,
    /// Whether the context has fields that need the core.
    fields: bool,
}

/// A slot whose newest samples the worker asks for, or whose last results it sets.
#[derive(Debug, Serialize)]
struct Values {
    name: String,
    /// The type in the context.
    ty: String,
    operations: Vec<Value>,
}

/// A value: a sample, or a result.
#[derive(Debug, Serialize)]
struct Value {
    name: String,
    method: String,
    place: usize,
    /// The type of the value.
    #[serde(rename = "value")]
    ty: String,
    /// The function that reads or writes it.
    read: String,
    /// Expression that makes a value of the read tuple.
    unwrapped: &'static str,
}

/// Samples that one handler gets together.
#[derive(Debug, Serialize)]
struct Collect {
    method: String,
    function: String,
    topics: Vec<Value>,
    /// The expression that describes it.
    #[serde(skip)]
    description: String,
    #[serde(skip)]
    handler: Handler,
}

impl Freshness {
    /// Whether there is nothing.
    pub(super) fn is_empty(&self) -> bool {
        self.kept.is_empty() && self.latest.is_empty() && self.collects.is_empty()
    }

    /// The types of the fields of the context.
    pub(super) fn types(&self) -> Vec<&str> {
        let all = self.kept.iter().chain(&self.latest);
        all.map(|slot| slot.ty.as_str()).collect()
    }

    /// Entries for the tables of the worker: descriptions, and handlers.
    pub(super) fn tables(&self) -> Vec<(String, String)> {
        let all = self.collects.iter();
        let all = all.map(|of| {
            let handler = format!("crate::freshness::{}::<W>", of.function);
            (of.description.clone(), handler)
        });
        all.collect()
    }

    /// Takes the handlers, which the worker implements by [`TRAIT`].
    pub(super) fn take_handlers(&mut self) -> Vec<Handler> {
        let handlers = self.collects.iter_mut().map(|of| {
            std::mem::replace(
                &mut of.handler,
                Handler::optional(String::new(), String::new()),
            )
        });
        handlers.collect()
    }
}

/// The type of a slot in the context. Empty if the context has none.
pub(super) fn ty(view: &view::Component, slot: &view::Slot) -> String {
    if slot.keeps_newest() {
        exports::async_name(view, &slot.name, "Samples")
    } else if slot.serves_latest() {
        exports::async_name(view, &slot.name, "Results")
    } else {
        String::new()
    }
}

/// All of them.
pub(super) fn of(view: &view::Component, exports: &Exports) -> Freshness {
    let slots = |chosen: fn(&view::Slot) -> bool| {
        let slots = view.slots.iter().filter(move |slot| chosen(slot));
        slots
            .map(|slot| Values {
                name: slot.name.clone(),
                ty: ty(view, slot),
                operations: values(view, slot),
            })
            .collect()
    };
    let collects = view.collects.iter();
    let has_type = |slot: &view::Slot| !ty(view, slot).is_empty();
    Freshness {
        fields: view.slots.iter().any(has_type),
        kept: slots(view::Slot::keeps_newest),
        latest: slots(view::Slot::serves_latest),
        collects: collects.map(|one| collect(view, one, exports)).collect(),
    }
}

/// The path of a type in the generated crate of a component.
fn path(module: &str, name: &str) -> String {
    let module = names::module(module);
    format!("::interfaces::{module}::{}", names::ty(name))
}

fn codec(module: &str, is_own: bool, name: &str) -> String {
    if is_own {
        format!("crate::interfaces::{module}::{name}")
    } else {
        format!("rc_runtime::middleware::{name}")
    }
}

fn values(view: &view::Component, slot: &view::Slot) -> Vec<Value> {
    let Some(interface) = view.interface(slot) else {
        return Vec::new();
    };
    let module = exports::interface_module(view, &slot.module, &slot.interface);
    let all = operation::all(interface, &path);
    let all = all.iter().zip(&interface.operations).enumerate();
    if slot.role == Role::SubscribesTo {
        return all
            .map(|(place, (operation, of))| Value {
                method: names::method(&of.name),
                ..topic(&module, place, operation, of)
            })
            .collect();
    }
    let queries = all.filter(|(_, (_, of))| {
        of.inputs.is_empty() && (of.result.is_some() || !of.outputs.is_empty())
    });
    queries
        .map(|(place, (operation, of))| Value {
            name: of.name.clone(),
            method: format!("set_{}", bare(&names::method(&of.name))),
            place,
            ty: match operation.answer.as_str() {
                "" => operation.result.clone(),
                answer => format!("crate::interfaces::{module}::{answer}"),
            },
            read: codec(&module, operation.codecs.own_reply, &operation.codecs.reply),
            unwrapped: "",
        })
        .collect()
}

fn topic(
    module: &str,
    place: usize,
    operation: &Operation,
    of: &view::library::Operation,
) -> Value {
    let types = of.inputs.iter().map(|member| types::member(member, &path));
    let (value, unwrapped) = match types.collect::<Vec<_>>().as_slice() {
        [one] => (one.clone(), ".map(|(value,)| value)"),
        all => (format!("({})", all.join(", ")), ""),
    };
    let read = &operation.codecs.read;
    Value {
        name: of.name.clone(),
        method: String::new(),
        place,
        ty: value,
        read: if operation.codecs.own_read {
            codec(module, true, read)
        } else {
            format!("{}::<{}>", codec(module, false, read), operation.arguments)
        },
        unwrapped,
    }
}

fn collect(view: &view::Component, of: &view::component::Collect, exports: &Exports) -> Collect {
    let method = names::method(&of.name);
    let mut taken: BTreeSet<String> = ["worker", "ctx", "samples"].map(str::to_owned).into();
    let (mut topics, mut arguments) = (Vec::new(), Vec::new());
    let mut mentioned = vec!["Fresh".to_owned()];
    let bare_type = |module: &str, name: &str| exports.ty(module, name);
    for (slot, place) in of.topics.iter().map(|topic| (topic.slot, topic.operation)) {
        let slot = &view.slots[slot];
        let Some(interface) = view.interface(slot) else {
            continue;
        };
        let module = exports::interface_module(view, &slot.module, &slot.interface);
        let all = operation::all(interface, &path);
        let (operation, declared) = (&all[place], &interface.operations[place]);
        // Two slots may have topics of one name.
        let own = names::local(&declared.name);
        let wanted = if taken.contains(&own) {
            format!("{}_{}", names::snake(&slot.name), bare(&own))
        } else {
            own
        };
        let name = free(names::local(&wanted), &mut taken);
        let types = declared.inputs.iter();
        let types = types.map(|member| types::member(member, &bare_type));
        let ty = match types.collect::<Vec<_>>().as_slice() {
            [one] => one.clone(),
            all => format!("({})", all.join(", ")),
        };
        arguments.push((name.clone(), format!("{name}: Fresh<{ty}>")));
        for member in &declared.inputs {
            let named: Vec<&Named> = member.ty.names();
            mentioned.extend(named.into_iter().map(|ty| names::ty(&ty.name)));
        }
        topics.push(Value {
            name,
            ..topic(&module, place, operation, declared)
        });
    }
    let topic_numbers = of.topics.iter();
    let topic_numbers = topic_numbers.map(|topic| format!("({}, {})", topic.slot, topic.operation));
    let description = format!(
        "rc_runtime::Collect {{ name: {:?}, topics: &[{}], within: std::time::Duration::new({}, {}) }}",
        of.name,
        topic_numbers.collect::<Vec<_>>().join(", "),
        of.within.seconds,
        of.within.nanoseconds
    );
    let mut all = vec!["&mut self".to_owned(), "ctx: &mut Context".to_owned()];
    all.extend(arguments.iter().map(|(_, argument)| argument.clone()));
    let unused =
        std::iter::once("ctx".to_owned()).chain(arguments.into_iter().map(|(name, _)| name));
    let head = format!("fn {method}");
    Collect {
        function: format!("collected_{}", bare(&method)),
        handler: Handler::collected(method.clone(), &head, &all, unused.collect(), mentioned),
        method,
        topics,
        description,
    }
}
