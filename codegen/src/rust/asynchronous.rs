//! Names and types of Rust for the asynchronous slots of a component: what
//! `templates/rust/asynchronous.rs.tera` prints.

use super::exports::{self, Exports};
use super::handlers::Handler;
use super::operation::{self, Operation};
use super::operation_names::{answer_name, error_name};
use super::{names, types};
use crate::collisions::{self, bare};
use crate::view;
use crate::view::library::Interface;
use serde::Serialize;
use std::collections::BTreeSet;

/// A slot whose queries can be started.
#[derive(Debug, Serialize)]
pub(crate) struct Asynchronous<'a> {
    name: &'a str,
    interface: &'a str,
    pub(super) index: usize,
    field: String,
    is_array: bool,
    /// The pattern of its member where the context finds its client, and how the field has that of
    /// the member.
    found: &'static str,
    of_member: &'static str,
    /// The argument of a handler for the member, with a comma before it.
    member_argument: &'static str,
    /// The type of its client, and of the client that only waits.
    pub(super) client: String,
    base: String,
    /// The module of the interface below `interfaces`.
    module: String,
    /// The trait that handles the ends.
    pub(super) handler: String,
    /// The function that reads a result.
    pub(super) end: String,
    /// The function of the client that takes a result.
    take: String,
    operations: Vec<Query<'a>>,
    /// The functions of the trait, as the user's worker has them.
    #[serde(skip)]
    pub(super) handlers: Vec<Handler>,
}

/// A query.
#[derive(Debug, Serialize)]
struct Query<'a> {
    /// The functions that start it and that handle its end.
    start: String,
    done: String,
    /// The types of its result and its error.
    ok: String,
    err: String,
    /// The place in the interface, and the function that reads the result.
    place: usize,
    read: String,
    of: Operation<'a>,
}

/// The asynchronous slots.
pub(super) fn all<'a>(view: &'a view::Component, exports: &Exports) -> Vec<Asynchronous<'a>> {
    let slots = view.slots.iter().enumerate();
    let slots = slots.filter(|(_, slot)| slot.asynchronous);
    slots
        .filter_map(|(index, slot)| Some(one(view, index, slot, view.interface(slot)?, exports)))
        .collect()
}

/// The path of a type in the generated crate of a component.
fn path(module: &str, name: &str) -> String {
    format!(
        "::interfaces::{}::{}",
        names::module(module),
        names::ty(name)
    )
}

fn one<'a>(
    view: &'a view::Component,
    index: usize,
    slot: &'a view::Slot,
    of: &'a Interface,
    exports: &Exports,
) -> Asynchronous<'a> {
    let module = exports::interface_module(view, &slot.module, &slot.interface);
    let methods = of.operations.iter().map(|o| names::method(&o.name));
    let mut functions: BTreeSet<String> = methods.collect();
    let take = collisions::free("take".to_owned(), &mut functions);
    let all = operation::all(of, &path).into_iter().enumerate();
    let queries = all.zip(&of.operations).filter(|(_, view)| view.two_way);
    let operations = queries.map(|((place, operation), view)| {
        let method = names::method(&view.name);
        let answer = operation.answer.clone();
        Query {
            start: collisions::free(format!("start_{}", bare(&method)), &mut functions),
            done: done(&method),
            ok: match answer.as_str() {
                "" => operation.result.clone(),
                answer => format!("interfaces::{module}::{answer}"),
            },
            err: match view.throws.as_slice() {
                [] => "rc_runtime::middleware::CallError".to_owned(),
                _ => format!("interfaces::{module}::{}", error_name(&view.name)),
            },
            place,
            read: if operation.codecs.own_result {
                format!("interfaces::{module}::{}", operation.codecs.take)
            } else {
                format!("rc_runtime::middleware::{}", operation.codecs.take)
            },
            of: operation,
        }
    });
    let field = names::snake(&slot.name);
    let operations = operations.collect();
    let queries = of.operations.iter().filter(|o| o.two_way);
    Asynchronous {
        name: &slot.name,
        interface: &slot.interface,
        index,
        is_array: slot.is_array,
        found: if slot.is_array {
            "Some(member)"
        } else {
            "None"
        },
        of_member: if slot.is_array { "[member]" } else { "" },
        member_argument: if slot.is_array {
            ", member: &Member"
        } else {
            ""
        },
        client: exports::async_name(view, &slot.name, "AsyncClient"),
        base: format!(
            "interfaces::{module}::{}Client",
            names::camel(&slot.interface)
        ),
        handler: exports::async_name(view, &slot.name, "Done"),
        end: format!("end_{}", bare(&field)),
        take,
        operations,
        handlers: queries
            .map(|query| handler(slot, &module, query, exports))
            .collect(),
        field,
        module,
    }
}

fn done(method: &str) -> String {
    format!("{}_done", bare(method))
}

/// The function of the user's worker that handles the ends of a query.
fn handler(
    slot: &view::Slot,
    module: &str,
    of: &view::library::Operation,
    exports: &Exports,
) -> Handler {
    let bare = |module: &str, name: &str| exports.ty(module, name);
    let result = of.result.iter().map(|ty| types::owned(ty, &bare));
    let outputs = of.outputs.iter().map(|m| types::member(m, &bare));
    let ok = match result.chain(outputs).collect::<Vec<_>>().as_slice() {
        [] => "()".to_owned(),
        [one] => one.clone(),
        _ => exports.of_interface(module, &answer_name(&of.name)),
    };
    let err = match of.throws.as_slice() {
        [] => "CallError".to_owned(),
        _ => exports.of_interface(module, &error_name(&of.name)),
    };
    let member = if slot.is_array {
        "member: &Member, "
    } else {
        ""
    };
    let method = done(&names::method(&of.name));
    let signature = format!(
        "fn {method}(&mut self, ctx: &mut Context, {member}call: CallId, result: Result<{ok}, {err}>)"
    );
    Handler::optional(method, signature)
}
