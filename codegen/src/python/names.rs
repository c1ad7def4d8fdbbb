//! How names of the description languages become names of Python.
//!
//! Classes are `UpperCamelCase`, enumerators and constants `UPPER_CASE`, everything else is
//! `snake_case`. Keywords of Python and names that generated code uses itself get a `_` at the end.
//! The wire keeps the names of the IDSL.

use crate::type_names;
use heck::{ToShoutySnakeCase, ToSnakeCase};

/// Keywords of Python 3.11 to 3.14.
const KEYWORDS: [&str; 35] = [
    "False", "None", "True", "and", "as", "assert", "async", "await", "break", "class", "continue",
    "def", "del", "elif", "else", "except", "finally", "for", "from", "global", "if", "import",
    "in", "is", "lambda", "nonlocal", "not", "or", "pass", "raise", "return", "try", "while",
    "with", "yield",
];

/// Names that annotations of generated classes use, where a member of the same name would hide
/// them.
const BUILTINS: [&str; 8] = [
    "bool", "bytes", "dict", "float", "int", "list", "object", "str",
];

/// What every exception has.
const OF_EXCEPTIONS: [&str; 3] = ["add_note", "args", "with_traceback"];

/// What every tuple has.
const OF_TUPLES: [&str; 2] = ["count", "index"];

/// Functions of values in place and of samples on loan, which have the members of their type.
const OF_LOANS: [&str; 4] = ["copy", "discard", "resize", "send"];

/// What generated modules import under these names, with a `_` before them.
const IMPORTS: [&str; 11] = [
    "abc",
    "dataclasses",
    "datetime",
    "enum",
    "np",
    "npt",
    "pathlib",
    "robocomp",
    "testing",
    "timedelta",
    "typing",
];

/// Names of generated functions for themselves.
const LOCALS: [&str; 4] = ["self", "ctx", "cls", "reply"];

/// Functions that every client or publisher has; those of values in place begin with `loan_` or end
/// with `_in_place`.
const METHODS: [&str; 4] = ["is_connected", "set_timeout", "subscribers", "timeout"];

/// What every context has.
const OF_CONTEXT: [&str; 18] = [
    "is_stopping",
    "lifecycle",
    "link",
    "logger",
    "machine",
    "name",
    "network",
    "now",
    "now_ns",
    "params",
    "period",
    "random",
    "set_period",
    "state",
    "stop",
    "time",
    "time_source",
    "tree",
];

/// What every context of a test has, beside the fakes of the slots.
const OF_TESTS: [&str; 10] = [
    "advance",
    "answer_defaults",
    "ctx",
    "link",
    "now",
    "run",
    "set_state",
    "set_time",
    "start",
    "transition",
];

/// Whether the context of a worker, or of its test, has this name itself.
pub(super) fn is_of_context(name: &str) -> bool {
    OF_CONTEXT.contains(&name) || OF_TESTS.contains(&name)
}

fn clear(name: String, taken: &[&[&str]]) -> String {
    let mut taken = taken.iter().flat_map(|names| names.iter());
    if KEYWORDS.contains(&name.as_str()) || taken.any(|other| *other == name) {
        name + "_"
    } else {
        name
    }
}

/// `snake_case` that begins with a letter: a leading `_` would make it private.
fn plain(name: &str) -> String {
    let snake = name.to_snake_case();
    if snake.starts_with(|c: char| c.is_ascii_alphabetic()) {
        snake
    } else {
        format!("n{snake}")
    }
}

/// A function or a variable.
pub(crate) fn snake(name: &str) -> String {
    clear(plain(name), &[])
}

/// A member of a class.
pub(crate) fn member(name: &str) -> String {
    clear(plain(name), &[&BUILTINS, &OF_LOANS])
}

/// A member of an exception.
pub(crate) fn exception_member(name: &str) -> String {
    clear(plain(name), &[&BUILTINS, &OF_EXCEPTIONS])
}

/// A member of the parameters.
pub(crate) fn parameter_member(name: &str) -> String {
    clear(plain(name), &[&BUILTINS, &["from_values"]])
}

/// A part of the reply of an operation that returns several values.
pub(crate) fn tuple_member(name: &str) -> String {
    clear(plain(name), &[&BUILTINS, &OF_TUPLES])
}

/// An operation of a client or a publisher.
pub(crate) fn method(name: &str) -> String {
    // An annotation after `def list` would mean this function.
    let name = clear(plain(name), &[&METHODS, &BUILTINS]);
    if name.starts_with("loan_") || name.ends_with("_in_place") {
        name + "_"
    } else {
        name
    }
}

/// A parameter of a generated function.
pub(crate) fn parameter(name: &str) -> String {
    clear(plain(name), &[&LOCALS])
}

/// A module.
pub(crate) fn module(name: &str) -> String {
    clear(plain(name), &[&IMPORTS])
}

/// A class. A name that could be one already stays as it is.
pub(crate) fn class(name: &str) -> String {
    clear(type_names::camel(name), &[])
}

/// A constant or an enumerator.
pub(crate) fn shout(name: &str) -> String {
    let shout = name.to_shouty_snake_case();
    if shout.starts_with(|c: char| c.is_ascii_alphabetic()) {
        shout
    } else {
        format!("N{shout}")
    }
}

/// The package of a component.
pub fn package(component: &str) -> String {
    component.to_snake_case()
}

/// Packages that a component would hide from its own worker, or from this project.
const PACKAGES: [&str; 12] = [
    "generated",
    "interfaces",
    "numpy",
    "pip",
    "pytest",
    "robocomp",
    "setuptools",
    "specific_worker",
    "src",
    "tests",
    "typing_extensions",
    "uv",
];

/// The modules of Python's library (`sys.stdlib_module_names` of 3.11 to 3.14) that a component may
/// not hide, without those that begin with `_`.
const STANDARD: &str = include_str!("standard_modules.txt");

/// Whether a component can have this name, which is that of its package.
///
/// # Errors
/// Why it cannot.
pub(crate) fn component(name: &str) -> Result<(), &'static str> {
    let package = package(name);
    let follows = |c: char| c.is_ascii_alphanumeric() || c == '_';
    if !name.starts_with(|c: char| c.is_ascii_alphabetic()) {
        Err("it must begin with a letter")
    } else if !name.chars().all(follows) {
        Err("it must consist of letters, digits and `_`")
    } else if name.len() > 64 {
        Err("it is longer than 64 characters")
    } else if KEYWORDS.contains(&package.as_str()) || KEYWORDS.contains(&name) {
        Err("it is a word of Python")
    } else if STANDARD.lines().any(|module| module == package) {
        Err("Python has a module of this name")
    } else if PACKAGES.contains(&package.as_str()) {
        Err("a package or folder that workers need has this name")
    } else {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_follow_python() {
        assert_eq!(snake("getLaserData"), "get_laser_data");
        assert_eq!(snake("class"), "class_");
        assert_eq!(snake("type"), "type");
        assert_eq!(snake("_1st"), "n1st");
        assert_eq!(snake("_"), "n");
        assert_eq!(member("float"), "float_");
        assert_eq!(exception_member("args"), "args_");
        assert_eq!(tuple_member("count"), "count_");
        assert_eq!(method("isConnected"), "is_connected_");
        assert_eq!(method("loanImage"), "loan_image_");
        assert_eq!(method("scanInPlace"), "scan_in_place_");
        assert_eq!(parameter("self"), "self_");
        assert_eq!(parameter("reply"), "reply_");
        assert_eq!(member("send"), "send_");
        assert_eq!(member("copy"), "copy_");
        assert_eq!(method("list"), "list_");
        assert_eq!(module("np"), "np_");
        assert_eq!(module("Typing"), "typing_");
        assert_eq!(class("datasayin"), "Datasayin");
        assert_eq!(class("RGBDParams"), "RGBDParams");
        assert_eq!(class("none"), "None_");
        assert_eq!(shout("None"), "NONE");
        assert_eq!(shout("VERY_SPECIAL_KIND"), "VERY_SPECIAL_KIND");
        assert_eq!(shout("_2nd"), "N2ND");
    }

    #[test]
    fn no_slot_hides_a_function_of_the_context_of_a_test() {
        let text = include_str!("../../../python/robocomp/testing.py");
        let class = text.split("class TestContext(").nth(1).expect("the class");
        let class = class.split("\n\n\n").next().expect("its text");
        let names = class.lines().filter_map(|line| {
            let name = line
                .strip_prefix("    def ")
                .or_else(|| line.strip_prefix("        self."))?;
            let end = name.find(|c: char| !(c.is_alphanumeric() || c == '_'))?;
            let is_set = line.starts_with("    def ") || name[end..].starts_with([' ', ':']);
            (is_set && !name.starts_with('_')).then(|| &name[..end])
        });
        let names: Vec<&str> = names.collect();
        assert!(
            names.contains(&"start") && names.contains(&"ctx"),
            "{names:?}"
        );
        for name in names {
            assert!(is_of_context(name), "{name}");
        }
    }

    #[test]
    fn a_component_hides_no_module_of_python() {
        for name in ["guard", "avoider_python", "Detector", "x"] {
            assert_eq!(component(name), Ok(()), "{name}");
        }
        for name in [
            "", "2d", "a b", "é", "lambda", "Json", "queue", "numpy", "robocomp",
        ] {
            assert!(component(name).is_err(), "{name}");
        }
    }
}
