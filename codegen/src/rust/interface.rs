//! Names and types of Rust for an interface: what `templates/rust/interface.tera` prints.

use super::operation::{self, Operation};
use super::shapes::{self, Shape};
use super::{names, those, types};
use crate::collisions::{self, bare};
use crate::view::library as view;
use serde::Serialize;
use std::collections::BTreeSet;

/// An interface.
#[derive(Debug, Serialize)]
pub(crate) struct Interface<'a> {
    name: &'a str,
    module: String,
    /// The documentation after the name of the interface.
    doc: Vec<&'a str>,
    client: String,
    publisher: String,
    calls: bool,
    topics: bool,
    /// The modules of the middleware that the code names.
    imports: Vec<&'static str>,
    /// The lines of the module with the fakes of its peers.
    fakes: Vec<&'static str>,
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
    /// Its variants, with the types and the discriminators of the exceptions.
    throws: String,
    /// The names of the error and of the operation, for each operation.
    operations: Vec<(String, String)>,
}

pub(super) fn of(interface: &view::Interface) -> Interface<'_> {
    let name = names::camel(&interface.name);
    let mut exceptions: Vec<(String, i32)> = interface
        .operations
        .iter()
        .flat_map(|operation| &operation.throws)
        .map(|exception| (operation::constant(interface, exception), exception.id))
        .collect();
    exceptions.sort();
    exceptions.dedup();
    let path = types::in_interface(&interface.module);
    let all = interface.operations.iter();
    let methods = all.clone().map(|o| names::method(&o.name));
    let mut functions: BTreeSet<String> = methods.collect();
    let mut variants = BTreeSet::new();
    let operations: Vec<Operation> = all
        .map(|o| operation::of(interface, o, &path, &mut functions, &mut variants))
        .collect();
    let errors = errors(interface, &operations);
    let shapes = shapes::all(interface, &operations);
    // Without a client and a publisher, codecs are not expanded.
    let names_typed = operations.iter().any(|operation| {
        (interface.calls || interface.topics) && operation.names_typed() || operation.throws()
    });
    let paragraph = (!interface.doc.is_empty()).then_some("");
    Interface {
        name: &interface.name,
        module: names::module(&interface.name),
        doc: paragraph
            .into_iter()
            .chain(interface.doc.iter().map(String::as_str))
            .collect(),
        client: format!("{name}Client"),
        publisher: format!("{name}Publisher"),
        calls: interface.calls,
        topics: interface.topics,
        shapes,
        imports: those(&[("rc_middleware::typed", names_typed)]),
        fakes: those(&[
            ("use super::*;", !operations.is_empty()),
            ("interface!(rc_runtime::fake_server);", interface.calls),
            ("interface!(rc_runtime::fake_subscriber);", interface.topics),
        ]),
        operations,
        exceptions,
        errors,
    }
}

/// One error for all operations that throw the same exceptions.
fn errors(interface: &view::Interface, operations: &[Operation]) -> Vec<ErrorEnum> {
    let mut taken = shapes::own_names(interface);
    let mut errors: Vec<(Vec<String>, ErrorEnum)> = Vec::new();
    for operation in operations.iter().filter(|o| o.throws()) {
        // A set: the order in the IDSL does not matter.
        let mut throws: Vec<String> = operation.throws.iter().map(|e| e.ty.clone()).collect();
        throws.sort();
        let own = (operation.error().to_owned(), operation.name.to_owned());
        if let Some((_, error)) = errors.iter_mut().find(|(set, _)| *set == throws) {
            error.operations.push(own);
            continue;
        }
        let variants = operation.throws.iter().map(|e| bare(&e.variant));
        let variants: Vec<&str> = variants.collect();
        let all = operation.throws.iter();
        let all = all.map(|e| format!("{}({}) = {}", e.variant, e.ty, e.constant));
        let all: Vec<String> = all.collect();
        let error = ErrorEnum {
            name: collisions::free(format!("{}OrCall", variants.join("Or")), &mut taken),
            throws: all.join(", "),
            operations: vec![own],
        };
        errors.push((throws, error));
    }
    errors.into_iter().map(|(_, error)| error).collect()
}
