//! Names that the code of an interface has for its operations and their exceptions.

use crate::names;
use rc_idsl::model::{Interface, Operation};

/// The name of an operation as types begin with it.
fn type_stem(operation: &Operation) -> String {
    let name = operation.name.text.as_str();
    let (first, rest) = name.split_at(name.chars().next().map_or(0, char::len_utf8));
    names::camel(&format!("{}{rest}", first.to_uppercase()))
}

/// The name of the error of an operation that throws.
pub(super) fn error_name(operation: &Operation) -> String {
    names::ty(&format!("{}Error", type_stem(operation)))
}

/// The name of what it answers, where that is several values.
pub(super) fn answer_name(operation: &Operation) -> String {
    format!("{}Answer", type_stem(operation))
}

/// The variant of such an error that holds an exception; `Call` is the one for a call without an answer.
pub(super) fn variant(exception: &str) -> String {
    let name = names::camel(exception);
    if name == "Call" { name + "_" } else { name }
}

/// The constant that describes an operation; `OPERATIONS` are all of them.
pub(super) fn operation_constant(operation: &Operation) -> String {
    let name = names::shout(&operation.name.text);
    if name == "OPERATIONS" {
        name + "_"
    } else {
        name
    }
}

/// The constant of an exception, beside those of the operations.
pub(super) fn exception_constant(interface: &Interface, exception: &str) -> String {
    let name = names::shout(exception);
    let mut operations = interface.operations.iter();
    if name == "OPERATIONS" || operations.any(|o| names::shout(&o.name.text) == name) {
        name + "_"
    } else {
        name
    }
}
