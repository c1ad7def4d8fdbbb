//! Converts names of the description languages into names of Rust.
//!
//! Types, traits and enumerators are `UpperCamelCase`, everything else is `snake_case`. Keywords of
//! Rust and names that generated code uses itself get a `_` at the end. The wire keeps the names of
//! the IDSL.

use crate::component_names;
use crate::type_names;
use heck::ToSnakeCase;

const WORDS: [&str; 53] = [
    "abstract", "as", "async", "await", "become", "box", "break", "const", "continue", "crate",
    "do", "dyn", "else", "enum", "extern", "false", "final", "fn", "for", "gen", "if", "impl",
    "in", "let", "loop", "macro", "match", "mod", "move", "mut", "override", "priv", "pub", "ref",
    "return", "self", "static", "struct", "super", "trait", "true", "try", "type", "typeof",
    "union", "unsafe", "unsized", "use", "virtual", "where", "while", "yield", "Self",
];

/// Names that generated functions use for themselves.
const LOCALS: [&str; 9] = [
    "ctx", "worker", "request", "reader", "writer", "result", "case", "answer", "error",
];

/// A field, a function or a module.
pub fn snake(name: &str) -> String {
    let snake = if is_snake(name) {
        name.to_owned()
    } else {
        name.to_snake_case()
    };
    let snake = if snake.is_empty() {
        "_".to_owned() + name
    } else if snake.starts_with(|c: char| c.is_ascii_digit()) {
        "_".to_owned() + &snake
    } else {
        snake
    };
    if WORDS.contains(&snake.as_str()) {
        snake + "_"
    } else {
        snake
    }
}

/// Whether a name is `snake_case` already, as most are that were made of others.
fn is_snake(name: &str) -> bool {
    let fits = |byte: u8| byte.is_ascii_lowercase() || byte.is_ascii_digit() || byte == b'_';
    let ends = [name.bytes().next(), name.bytes().next_back()];
    ends.iter().all(|end| end.is_some_and(|byte| byte != b'_'))
        && name.bytes().all(fits)
        && !name.contains("__")
}

/// Functions that every client or publisher has.
const METHODS: [&str; 5] = [
    "freshness",
    "is_connected",
    "new",
    "set_timeout",
    "subscribers",
];

/// An operation.
pub fn method(name: &str) -> String {
    let snake = snake(name);
    if METHODS.contains(&snake.as_str()) {
        snake + "_"
    } else {
        snake
    }
}

/// A module of an interface or of types. Generated code has others of these names.
pub fn module(name: &str) -> String {
    let snake = snake(name);
    // `lib` and `main` are the roots of a crate.
    if ["cdr", "lib", "main", "std"].contains(&snake.as_str()) {
        snake + "_"
    } else {
        snake
    }
}

/// A parameter or a variable of a generated function.
pub fn local(name: &str) -> String {
    let snake = snake(name);
    if LOCALS.contains(&snake.as_str()) {
        snake + "_"
    } else {
        snake
    }
}

/// A type, a trait or an enumerator. A name that could be one already stays as it is.
pub fn camel(name: &str) -> String {
    let camel = type_names::camel(name);
    if WORDS.contains(&camel.as_str()) {
        camel + "_"
    } else {
        camel
    }
}

/// Types that generated code uses by their bare names.
const TYPES: [&str; 16] = [
    "Box",
    "CallError",
    "Cdr",
    "DecodeError",
    "Default",
    "HandlerError",
    "OpenError",
    "Option",
    "Reader",
    "Request",
    "Result",
    "SendError",
    "String",
    "TypedClient",
    "Vec",
    "Writer",
];

/// In the names of structures in shared memory, and of no type of the IDSL.
pub(crate) const IN_PLACE: &str = "InPlace";

/// A type or a trait of the generated crate.
pub fn ty(name: &str) -> String {
    let camel = camel(name);
    if TYPES.contains(&camel.as_str()) || camel.contains(IN_PLACE) {
        camel + "_"
    } else {
        camel
    }
}

/// A constant.
pub fn shout(name: &str) -> String {
    let shout = snake(name).trim_end_matches('_').to_uppercase();
    // Every module has its description under this name.
    if shout == "RC_DESCRIPTION" {
        shout + "_"
    } else {
        shout
    }
}

/// Names of packages that Rust, cargo or this project has for something else.
const PACKAGES: [(&str, &str); 11] = [
    ("alloc", "it is a crate of Rust"),
    ("core", "it is a crate of Rust"),
    ("proc_macro", "it is a crate of Rust"),
    ("std", "it is a crate of Rust"),
    ("test", "it is a crate of Rust"),
    (
        "build",
        "cargo has a folder of this name for what it builds",
    ),
    ("deps", "cargo has a folder of this name for what it builds"),
    (
        "examples",
        "cargo has a folder of this name for what it builds",
    ),
    (
        "incremental",
        "cargo has a folder of this name for what it builds",
    ),
    ("generated", "rcgen has a folder of this name"),
    ("interfaces", "it is the crate of the interfaces"),
];

/// Whether a component can have this name, which is that of its package, its library and its
/// program.
///
/// # Errors
/// The reason for which it cannot.
pub fn component(name: &str) -> Result<(), &'static str> {
    let package = package(name);
    component_names::fits(name)?;
    if WORDS.contains(&package.as_str()) || WORDS.contains(&name) {
        Err("it is a word of Rust")
    } else if package.starts_with("rc_") {
        Err("crates of this project begin with `rc_`")
    } else if package.ends_with("_generated") {
        Err("crates that rcgen generates end with `_generated`")
    } else {
        let mut taken = PACKAGES.iter();
        let taken = taken.find(|(taken, _)| *taken == package);
        taken.map_or(Ok(()), |(_, reason)| Err(reason))
    }
}

/// The package of a component.
pub fn package(component: &str) -> String {
    component.to_snake_case()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_component_is_a_package_a_library_and_a_program() {
        for name in ["guard", "Guard", "lidar2", "x", "type_of_thing"] {
            assert_eq!(component(name), Ok(()), "{name}");
        }
        for name in [
            "",
            "2d",
            "a b",
            "é",
            "match",
            "Self",
            "test",
            "Deps",
            "interfaces",
            "rc_runtime",
            "guard_generated",
        ] {
            assert!(component(name).is_err(), "{name}");
        }
    }

    #[test]
    fn names_follow_rust() {
        assert_eq!(snake("getLaserData"), "get_laser_data");
        assert_eq!(snake("type"), "type_");
        assert_eq!(snake("_1st"), "_1st");
        assert_eq!(method("isConnected"), "is_connected_");
        assert_eq!(module("Lib"), "lib_");
        assert_eq!(module("Main"), "main_");
        assert_eq!(local("request"), "request_");
        assert_eq!(camel("datasayin"), "Datasayin");
        assert_eq!(camel("TData"), "TData");
        assert_eq!(camel("RGBDParams"), "RGBDParams");
        assert_eq!(camel("IDLE_MODE"), "IdleMode");
        assert_eq!(camel("None"), "None");
        assert_eq!(camel("self"), "Self_");
        assert_eq!(ty("result"), "Result_");
        assert_eq!(ty("TResult"), "TResult");
        assert_eq!(ty("ScanInPlace"), "ScanInPlace_");
        assert_eq!(shout("sayHello"), "SAY_HELLO");
    }
}
