//! Converts names of the description languages into names of Python, in generated packages and in
//! clients whose types are known at run time only.
//!
//! Enumerators are `UPPER_CASE`, everything else is `snake_case`. Keywords of Python and names that
//! Python or the package uses itself get a `_` at the end.

use heck::{ToShoutySnakeCase, ToSnakeCase};

/// Keywords of Python 3.11 to 3.14.
pub const KEYWORDS: [&str; 35] = [
    "False", "None", "True", "and", "as", "assert", "async", "await", "break", "class", "continue",
    "def", "del", "elif", "else", "except", "finally", "for", "from", "global", "if", "import",
    "in", "is", "lambda", "nonlocal", "not", "or", "pass", "raise", "return", "try", "while",
    "with", "yield",
];

/// Names that annotations of generated classes use, where a member of the same name would hide
/// them.
pub const BUILTINS: [&str; 8] = [
    "bool", "bytes", "dict", "float", "int", "list", "object", "str",
];

/// Names that every exception has.
const OF_EXCEPTIONS: [&str; 3] = ["add_note", "args", "with_traceback"];

/// Names that every tuple has.
const OF_TUPLES: [&str; 2] = ["count", "index"];

/// Functions of values in place and of samples on loan, which have the members of their type.
const OF_LOANS: [&str; 4] = ["copy", "discard", "resize", "send"];

/// Names of generated functions for themselves.
const LOCALS: [&str; 4] = ["self", "ctx", "cls", "reply"];

/// Functions that every client or publisher has; those of values in place begin with `loan_` or end
/// with `_in_place`.
const METHODS: [&str; 4] = ["is_connected", "set_timeout", "subscribers", "timeout"];

/// The name, with a `_` if it is a keyword or one of these.
#[must_use]
pub fn clear(name: String, taken: &[&[&str]]) -> String {
    let mut taken = taken.iter().flat_map(|names| names.iter());
    if KEYWORDS.contains(&name.as_str()) || taken.any(|other| *other == name) {
        name + "_"
    } else {
        name
    }
}

/// `snake_case` that begins with a letter: a leading `_` would make it private.
#[must_use]
pub fn plain(name: &str) -> String {
    let snake = name.to_snake_case();
    if snake.starts_with(|c: char| c.is_ascii_alphabetic()) {
        snake
    } else {
        format!("n{snake}")
    }
}

/// A function or a variable.
#[must_use]
pub fn snake(name: &str) -> String {
    clear(plain(name), &[])
}

/// A member of a class.
#[must_use]
pub fn member(name: &str) -> String {
    clear(plain(name), &[&BUILTINS, &OF_LOANS])
}

/// A member of an exception.
#[must_use]
pub fn exception_member(name: &str) -> String {
    clear(plain(name), &[&BUILTINS, &OF_EXCEPTIONS])
}

/// A part of the reply of an operation that returns several values.
#[must_use]
pub fn tuple_member(name: &str) -> String {
    clear(plain(name), &[&BUILTINS, &OF_TUPLES])
}

/// An operation of a client or a publisher.
#[must_use]
pub fn method(name: &str) -> String {
    // An annotation after `def list` would mean this function.
    let name = clear(plain(name), &[&METHODS, &BUILTINS]);
    if name.starts_with("loan_") || name.ends_with("_in_place") {
        name + "_"
    } else {
        name
    }
}

/// A parameter of a generated function.
#[must_use]
pub fn parameter(name: &str) -> String {
    clear(plain(name), &[&LOCALS])
}

/// A constant or an enumerator.
#[must_use]
pub fn shout(name: &str) -> String {
    let shout = name.to_shouty_snake_case();
    if shout.starts_with(|c: char| c.is_ascii_alphabetic()) {
        shout
    } else {
        format!("N{shout}")
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
        assert_eq!(shout("None"), "NONE");
        assert_eq!(shout("VERY_SPECIAL_KIND"), "VERY_SPECIAL_KIND");
        assert_eq!(shout("_2nd"), "N2ND");
    }
}
