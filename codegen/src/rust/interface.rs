//! Names and types of Rust for an interface: what `templates/rust/interface.tera` prints.

use super::codecs::{Codecs, placed};
use super::members::{Member, member};
use super::operation_names::{
    answer_name, bare, error_name, exception_constant, operation_constant, plain, variant,
};
use super::shapes::{self, Shape};
use super::{names, types};
use crate::view::documentation;
use crate::view::library as view;
use crate::view::members;
use crate::view::types::{Named, Type};
use serde::Serialize;
use std::collections::BTreeSet;

/// The most parts of a tuple that `rc_middleware::typed` reads and writes.
const MOST_PARTS: usize = 8;

/// An interface.
#[derive(Debug, Serialize)]
pub(crate) struct Interface<'a> {
    name: &'a str,
    module: String,
    doc: &'a [String],
    client: String,
    publisher: String,
    calls: bool,
    topics: bool,
    /// Whether the code names the module `typed` of the middleware.
    names_typed: bool,
    operations: Vec<Operation<'a>>,
    exceptions: Vec<(String, i32)>,
    /// One for each set of exceptions that operations throw.
    errors: Vec<ErrorEnum>,
    /// The lists of operations.
    shapes: Vec<Shape>,
}

/// The error of all operations that throw the same exceptions.
#[derive(Debug, Serialize)]
struct ErrorEnum {
    name: String,
    throws: Vec<Exception>,
    /// The names of the error and of the operation, for each operation.
    operations: Vec<(String, String)>,
}

#[derive(Debug, Serialize)]
pub(super) struct Operation<'a> {
    name: &'a str,
    method: String,
    /// The functions that lend a sample, and that read a reply in place.
    loan: String,
    read_in_place: String,
    /// The operation as a part of the name of a function.
    plain: String,
    constant: String,
    doc: Vec<String>,
    id: i32,
    type_hash: &'a str,
    two_way: bool,
    inputs: Vec<Member<'a>>,
    /// The inputs as a tuple of variables, of types, and as a client sends them.
    pattern: String,
    arguments: String,
    sent: String,
    #[serde(flatten)]
    pub(super) codecs: Codecs,
    /// Members of the reply, in the order of the wire.
    replies: Vec<Member<'a>>,
    /// Variables of the reply in the order of the returned tuple, whose first is the value of the
    /// operation.
    returned: Vec<String>,
    pub(super) result: String,
    /// The name of the tuple, and its types; empty where it is none.
    pub(super) answer: String,
    answer_types: Vec<String>,
    /// The error under the name of the operation; empty if it throws nothing.
    error: String,
    throws: Vec<Exception>,
    /// The structure of a sample, and of a result, in shared memory; else empty.
    sample_in_place: String,
    result_in_place: String,
    /// How a fake names a call, and sets its answer.
    variant: String,
    on: String,
}

impl Operation<'_> {
    /// Whether its codecs name the module `typed`. Those of a sample in place do not.
    fn names_typed(&self) -> bool {
        self.two_way || !self.codecs.own_read || self.codecs.own_write
    }
}

#[derive(Clone, Debug, Serialize)]
struct Exception {
    variant: String,
    ty: String,
    constant: String,
}

pub(super) fn of(interface: &view::Interface) -> Interface<'_> {
    let name = names::camel(&interface.name);
    let mut exceptions: Vec<(String, i32)> = interface
        .operations
        .iter()
        .flat_map(|operation| &operation.throws)
        .map(|exception| (constant(interface, exception), exception.id))
        .collect();
    exceptions.sort();
    exceptions.dedup();
    let path = types::in_interface(&interface.module);
    let all = interface.operations.iter();
    let methods = all.clone().map(|o| names::method(&o.name));
    let mut functions: BTreeSet<String> = methods.collect();
    let mut variants = BTreeSet::new();
    let operations: Vec<Operation> = all
        .map(|o| operation(interface, o, &path, &mut functions, &mut variants))
        .collect();
    let errors = errors(interface, &operations);
    let codecs: Vec<&Codecs> = operations.iter().map(|o| &o.codecs).collect();
    let shapes = shapes::all(interface, &codecs);
    Interface {
        name: &interface.name,
        module: names::module(&interface.name),
        doc: &interface.doc,
        client: format!("{name}Client"),
        publisher: format!("{name}Publisher"),
        calls: interface.calls,
        topics: interface.topics,
        shapes,
        // Without a client and a publisher, codecs are not expanded.
        names_typed: operations.iter().any(|operation| {
            (interface.calls || interface.topics) && operation.names_typed()
                || !operation.error.is_empty()
        }),
        operations,
        exceptions,
        errors,
    }
}

/// The operations of an interface with the types of another crate, whose paths `path` writes.
pub(super) fn operations<'a>(
    interface: &'a view::Interface,
    path: types::Path,
) -> Vec<Operation<'a>> {
    let (mut functions, mut variants) = (BTreeSet::new(), BTreeSet::new());
    let all = interface.operations.iter();
    all.map(|o| operation(interface, o, path, &mut functions, &mut variants))
        .collect()
}

/// One error for all operations that throw the same exceptions.
fn errors(interface: &view::Interface, operations: &[Operation]) -> Vec<ErrorEnum> {
    let mut taken = shapes::own_names(interface);
    let mut errors: Vec<(Vec<String>, ErrorEnum)> = Vec::new();
    for operation in operations.iter().filter(|o| !o.throws.is_empty()) {
        // A set: the order in the IDSL does not matter.
        let mut throws: Vec<String> = operation.throws.iter().map(|e| e.ty.clone()).collect();
        throws.sort();
        let own = (operation.error.clone(), operation.name.to_owned());
        if let Some((_, error)) = errors.iter_mut().find(|(set, _)| *set == throws) {
            error.operations.push(own);
            continue;
        }
        let variants = operation.throws.iter().map(|e| bare(&e.variant));
        let variants: Vec<&str> = variants.collect();
        let error = ErrorEnum {
            name: names::free(format!("{}OrCall", variants.join("Or")), &mut taken),
            throws: operation.throws.clone(),
            operations: vec![own],
        };
        errors.push((throws, error));
    }
    errors.into_iter().map(|(_, error)| error).collect()
}

fn constant(interface: &view::Interface, exception: &view::Exception) -> String {
    let operations = interface.operations.iter().map(|o| o.name.as_str());
    exception_constant(operations, type_name(&exception.ty))
}

fn type_name(ty: &Type) -> &str {
    match ty {
        Type::Named(Named { name, .. }) => name,
        _ => "",
    }
}

/// A tuple of Rust, which has a comma behind its only part.
pub(super) fn tuple(parts: &[String]) -> String {
    match parts {
        [one] => format!("({one},)"),
        all => format!("({})", all.join(", ")),
    }
}

/// `functions` are those that the client or the publisher has by now, `variants` those of the
/// calls that fakes keep.
fn operation<'a>(
    interface: &'a view::Interface,
    of: &'a view::Operation,
    path: types::Path,
    functions: &mut BTreeSet<String>,
    variants: &mut BTreeSet<String>,
) -> Operation<'a> {
    let parameters = |members: &'a [members::Member]| -> Vec<Member<'a>> {
        let members = members.iter();
        members
            .map(|m| member(m, names::local(&m.name), path))
            .collect()
    };
    let inputs = parameters(&of.inputs);
    let mut replies = parameters(&of.outputs);
    let mut returned: Vec<String> = replies.iter().map(|m| m.name.clone()).collect();
    let mut answer_types: Vec<String> = replies.iter().map(|m| m.ty.clone()).collect();
    if let Some(result) = &of.result {
        let ty = types::owned(result, path);
        returned.insert(0, "result".to_owned());
        answer_types.insert(0, ty.clone());
        replies.push(Member {
            idsl: "result",
            name: "result".to_owned(),
            doc: Vec::new(),
            ty,
            default: String::new(),
            optional: false,
            checks: &of.result_checks,
            borrowed: String::new(),
            write: "reference",
        });
    }
    let (answer, result) = match answer_types.as_slice() {
        [] => (String::new(), "()".to_owned()),
        [one] => (String::new(), one.clone()),
        _ => (answer_name(&of.name), answer_name(&of.name)),
    };
    let method = names::method(&of.name);
    let mut function = |there: bool, wanted: String| {
        let name = there.then(|| names::free(wanted, functions));
        name.unwrap_or_default()
    };
    let loan = function(
        of.sample_in_place.is_some(),
        format!("loan_{}", bare(&method)),
    );
    let read_in_place = function(
        of.result_in_place.is_some(),
        format!("{}_in_place", bare(&method)),
    );
    let throws = of.throws.iter().map(|exception| Exception {
        variant: variant(type_name(&exception.ty)),
        ty: types::owned(&exception.ty, path),
        constant: constant(interface, exception),
    });
    let plain = plain(&of.name);
    let checked = |members: &[Member]| members.iter().any(|m| !m.checks.is_empty());
    let own_write = checked(&inputs) || inputs.len() > MOST_PARTS;
    let own_read = own_write || of.sample_in_place.is_some();
    // The result is the first part in Rust, and the last one on the wire.
    let turned = of.result.is_some() && !of.outputs.is_empty();
    let own_reply = turned || checked(&replies) || replies.len() > MOST_PARTS;
    let own_result = own_reply || of.result_in_place.is_some();
    let function = |own: bool, name: &str| {
        if own {
            format!("{name}_{plain}")
        } else {
            format!("typed::{name}")
        }
    };
    let names: Vec<String> = inputs.iter().map(|m| m.name.clone()).collect();
    let types: Vec<String> = inputs.iter().map(|m| m.ty.clone()).collect();
    let sent = inputs.iter().map(|m| match m.write {
        "value" => format!("&{}", m.name),
        _ => m.name.clone(),
    });
    Operation {
        name: &of.name,
        loan,
        read_in_place,
        constant: operation_constant(&of.name),
        doc: documentation::of_operation(of, names::local),
        id: of.id,
        type_hash: &of.type_hash,
        two_way: of.two_way,
        pattern: tuple(&names),
        arguments: tuple(&types),
        sent: tuple(&sent.collect::<Vec<_>>()),
        codecs: Codecs {
            read: function(own_read, "read"),
            reply: function(own_reply, "reply"),
            take: function(own_result, "result"),
            own_read,
            own_write,
            own_reply,
            own_result,
        },
        inputs,
        replies,
        returned,
        result,
        answer,
        answer_types,
        error: if of.throws.is_empty() {
            String::new()
        } else {
            error_name(&of.name)
        },
        throws: throws.collect(),
        sample_in_place: placed(of.sample_in_place.as_ref(), path),
        result_in_place: placed(of.result_in_place.as_ref(), path),
        variant: names::free(names::camel(&of.name), variants),
        on: format!("on_{}", bare(&method)),
        method,
        plain,
    }
}
