//! Names of Rust for the operations of an interface and their exceptions, from their names in the
//! IDSL.

use super::names;

/// The name of an operation as types begin with it.
fn type_stem(operation: &str) -> String {
    let (first, rest) = operation.split_at(operation.chars().next().map_or(0, char::len_utf8));
    names::camel(&format!("{}{rest}", first.to_uppercase()))
}

/// The error of an operation that throws.
pub(crate) fn error_name(operation: &str) -> String {
    names::ty(&format!("{}Error", type_stem(operation)))
}

/// The reply of an operation that returns several values.
pub(crate) fn answer_name(operation: &str) -> String {
    format!("{}Answer", type_stem(operation))
}

/// The variant of such an error that holds an exception; `Call` is the one for a call without a
/// reply.
pub(crate) fn variant(exception: &str) -> String {
    let name = names::camel(exception);
    if name == "Call" { name + "_" } else { name }
}

/// The constant that describes an operation; `OPERATIONS` are all of them.
pub(crate) fn operation_constant(operation: &str) -> String {
    let name = names::shout(operation);
    if name == "OPERATIONS" {
        name + "_"
    } else {
        name
    }
}

/// The constant of an exception, in addition to those of the operations.
pub(crate) fn exception_constant<'a>(
    mut operations: impl Iterator<Item = &'a str>,
    exception: &str,
) -> String {
    let name = names::shout(exception);
    if name == "OPERATIONS" || operations.any(|operation| names::shout(operation) == name) {
        name + "_"
    } else {
        name
    }
}

/// An operation as a part of a function's name: `read_…`.
pub(crate) fn plain(operation: &str) -> String {
    names::shout(operation).to_lowercase()
}
