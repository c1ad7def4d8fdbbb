//! Converts names of the description languages into names of C++: they stay as they are, as in
//! RoboComp's generated headers. Words of C++ get the prefix that Ice gives them.

use crate::component_names;
use crate::type_names;
use heck::ToSnakeCase;

/// Words of C++20, macros of its headers that are not names, those of the compilers for GNU's C++, and the words of Qt.
const WORDS: [&str; 115] = [
    "alignas",
    "alignof",
    "and",
    "and_eq",
    "asm",
    "assert",
    "auto",
    "bitand",
    "bitor",
    "bool",
    "break",
    "case",
    "catch",
    "char",
    "char16_t",
    "char32_t",
    "char8_t",
    "class",
    "co_await",
    "co_return",
    "co_yield",
    "compl",
    "concept",
    "const",
    "const_cast",
    "consteval",
    "constexpr",
    "constinit",
    "continue",
    "decltype",
    "default",
    "delete",
    "do",
    "double",
    "dynamic_cast",
    "else",
    "emit",
    "enum",
    "errno",
    "explicit",
    "export",
    "extern",
    "false",
    "float",
    "for",
    "foreach",
    "forever",
    "friend",
    "goto",
    "if",
    "inline",
    "int",
    "linux",
    "long",
    "major",
    "makedev",
    "minor",
    "mutable",
    "namespace",
    "new",
    "noexcept",
    "not",
    "not_eq",
    "nullptr",
    "operator",
    "or",
    "or_eq",
    "private",
    "protected",
    "public",
    "register",
    "reinterpret_cast",
    "requires",
    "return",
    "short",
    "signals",
    "signed",
    "sizeof",
    "slots",
    "static",
    "static_assert",
    "static_cast",
    "stderr",
    "stdin",
    "stdout",
    "struct",
    "switch",
    "template",
    "this",
    "thread_local",
    "throw",
    "true",
    "try",
    "typedef",
    "typeid",
    "typename",
    "union",
    "unix",
    "unsigned",
    "using",
    "virtual",
    "void",
    "volatile",
    "wchar_t",
    "while",
    "xor",
    "xor_eq",
    "EOF",
    "NULL",
    "INFINITY",
    "NAN",
    "BUFSIZ",
    "BIG_ENDIAN",
    "BYTE_ORDER",
    "LITTLE_ENDIAN",
];

/// Whether a name is a word of C++.
pub(crate) fn is_word(name: &str) -> bool {
    WORDS.contains(&name)
}

/// Whether names of this form are those of the framework's headers.
pub(crate) fn is_of_headers(name: &str) -> bool {
    name.starts_with("rc_")
}

/// A name of a description: itself, or as Ice names a word of C++.
pub(crate) fn own(name: &str) -> String {
    if is_word(name) || is_of_headers(name) {
        format!("_cpp_{name}")
    } else {
        name.to_owned()
    }
}

/// `snake_case`, for functions of the modern form.
pub(crate) fn snake(name: &str) -> String {
    own(&name.to_snake_case())
}

/// `UpperCamelCase`, for states and events.
pub(crate) fn camel(name: &str) -> String {
    own(&type_names::camel(name))
}

/// The handler of an operation: `Laser_getLaserData`.
pub(crate) fn handler(slot: &str, operation: &str) -> String {
    format!("{slot}_{operation}")
}

/// The client or publisher of a slot, as RoboComp names it: `laser_proxy`, `laserpub_pubproxy`.
pub(crate) fn proxy(slot: &str, publishes: bool) -> String {
    let end = if publishes { "pubproxy" } else { "proxy" };
    format!("{}_{end}", slot.to_lowercase())
}

/// Checks the name of a new component.
///
/// # Errors
/// The reason against it.
pub(crate) fn component(name: &str) -> Result<(), &'static str> {
    /// Targets of cmake, and folders and files of a component.
    const TAKEN: [&str; 9] = [
        "all",
        "clean",
        "edit_cache",
        "generated",
        "help",
        "install",
        "rebuild_cache",
        "src",
        "test",
    ];
    component_names::fits(name)?;
    if is_word(name) {
        Err("it is a word of C++")
    } else if TAKEN.contains(&name) {
        Err("cmake has a target of this name, or a component a folder")
    } else {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_those_of_robocomp() {
        assert_eq!(own("TLaserData"), "TLaserData");
        assert_eq!(own("class"), "_cpp_class");
        assert_eq!(own("final"), "final");
        assert_eq!(own("rc_members"), "_cpp_rc_members");
        assert_eq!(snake("getLaserData"), "get_laser_data");
        assert_eq!(snake("Delete"), "_cpp_delete");
        assert_eq!(proxy("DifferentialRobot", false), "differentialrobot_proxy");
        assert_eq!(proxy("LaserPub", true), "laserpub_pubproxy");
        assert!(component("test").is_err() && component("eyes").is_ok());
    }
}
