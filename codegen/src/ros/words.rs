//! The rules of ROS 2 for names (REP 2003, and what `rosidl` refuses).

use heck::{ToShoutySnakeCase, ToSnakeCase, ToUpperCamelCase};

/// Words that cannot be the name of a field, since `rosidl` makes members of C, C++ and Python of these: keywords, and
/// macros that a compiler has by itself or that every message includes.
const WORDS: [&str; 127] = [
    "alignas",
    "alignof",
    "and",
    "and_eq",
    "as",
    "asm",
    "assert",
    "async",
    "atomic_cancel",
    "atomic_commit",
    "atomic_noexcept",
    "auto",
    "await",
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
    "def",
    "default",
    "del",
    "delete",
    "do",
    "double",
    "dynamic_cast",
    "elif",
    "else",
    "enum",
    "errno",
    "except",
    "explicit",
    "export",
    "extern",
    "false",
    "finally",
    "float",
    "for",
    "friend",
    "from",
    "global",
    "goto",
    "i386",
    "if",
    "import",
    "in",
    "inline",
    "int",
    "is",
    "lambda",
    "linux",
    "long",
    "mutable",
    "namespace",
    "new",
    "noexcept",
    "nonlocal",
    "not",
    "not_eq",
    "nullptr",
    "operator",
    "or",
    "or_eq",
    "pass",
    "private",
    "protected",
    "public",
    "raise",
    "reflexpr",
    "register",
    "reinterpret_cast",
    "requires",
    "restrict",
    "return",
    "self",
    "short",
    "signed",
    "sizeof",
    "static",
    "static_assert",
    "static_cast",
    "stderr",
    "stdin",
    "stdout",
    "struct",
    "switch",
    "synchronized",
    "template",
    "this",
    "thread_local",
    "throw",
    "true",
    "try",
    "typedef",
    "typeid",
    "typename",
    "typeof",
    "union",
    "unix",
    "unsigned",
    "using",
    "virtual",
    "void",
    "volatile",
    "wchar_t",
    "while",
    "with",
    "xor",
    "xor_eq",
    "yield",
];

/// The same for types and constants.
const CAPITAL_WORDS: [&str; 9] = [
    "EOF", "FALSE", "False", "INFINITY", "NAN", "NULL", "None", "TRUE", "True",
];

/// A field: `[a-z][a-z0-9_]*`, no `_` at its end and no two in a row.
pub(super) fn field(name: &str) -> String {
    let snake = led(&name.to_snake_case(), "n");
    if WORDS.contains(&snake.as_str()) {
        snake + "_value"
    } else {
        snake
    }
}

/// A constant: the same in capitals.
pub(super) fn constant(name: &str) -> String {
    let shout = led(&name.to_shouty_snake_case(), "N");
    if CAPITAL_WORDS.contains(&shout.as_str()) {
        shout + "_VALUE"
    } else {
        shout
    }
}

/// A part of the name of a type: what could be one with a capital in front stays as it is.
pub(super) fn camel(name: &str) -> String {
    let (first, rest) = name.split_at(name.len().min(1));
    let camel = if first == "_" || rest.contains('_') {
        name.to_upper_camel_case()
    } else {
        first.to_uppercase() + rest
    };
    led(&camel, "N")
}

/// A message or a service: `[A-Z][A-Za-z0-9]*`.
pub(super) fn ty(name: &str) -> String {
    let camel = camel(name);
    if CAPITAL_WORDS.contains(&camel.as_str()) {
        camel + "Type"
    } else {
        camel
    }
}

/// A package of a module: `RoboCompLaser` is `robocomp_laser_msgs`.
pub(super) fn package(module: &str) -> String {
    let own = module
        .strip_prefix("RoboComp")
        .unwrap_or(module)
        .to_snake_case();
    let between = if own.is_empty() { "" } else { "_" };
    format!("robocomp{between}{own}_msgs")
}

/// Whether ROS takes this for the name of a package.
pub(super) fn is_package(name: &str) -> bool {
    let letters = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_';
    name.len() > 1
        && name.starts_with(|c: char| c.is_ascii_lowercase())
        && name.chars().all(letters)
        && !name.ends_with('_')
        && !name.contains("__")
}

/// Whether ROS takes this for the name of a type.
pub(super) fn is_type(name: &str) -> bool {
    name.starts_with(|c: char| c.is_ascii_uppercase())
        && name.chars().all(|c| c.is_ascii_alphanumeric())
}

/// A name that begins with a letter.
fn led(name: &str, letter: &str) -> String {
    if name.starts_with(|c: char| c.is_ascii_alphabetic()) {
        name.to_owned()
    } else {
        format!("{letter}{name}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_follow_ros() {
        assert_eq!(field("correctedX"), "corrected_x");
        assert_eq!(field("class"), "class_value");
        assert_eq!(field("_1"), "n1");
        assert_eq!(field("__"), "n");
        assert_eq!(field("a__b_"), "a_b");
        assert_eq!(constant("IdleMode"), "IDLE_MODE");
        assert_eq!(constant("null"), "NULL_VALUE");
        assert_eq!(ty("TData"), "TData");
        assert_eq!(ty("RGBImage"), "RGBImage");
        assert_eq!(ty("laser_scan"), "LaserScan");
        assert_eq!(ty("none"), "NoneType");
        assert_eq!(ty("_3d"), "N3d");
        assert_eq!(camel("getLaserAndBStateData"), "GetLaserAndBStateData");
        assert_eq!(package("RoboCompLaser"), "robocomp_laser_msgs");
        assert_eq!(package("Arm"), "robocomp_arm_msgs");
        assert_eq!(package("RoboComp"), "robocomp_msgs");
    }

    #[test]
    fn what_is_a_name() {
        for (name, right) in [
            ("sensor_msgs", true),
            ("a", false),
            ("Sensor", false),
            ("a__b", false),
            ("a_", false),
            ("3d", false),
            ("", false),
        ] {
            assert_eq!(is_package(name), right, "{name}");
        }
        assert!(is_type("LaserScan") && !is_type("laserScan") && !is_type("Laser_Scan"));
    }

    #[test]
    fn words_are_found() {
        assert!(WORDS.is_sorted() && CAPITAL_WORDS.is_sorted());
    }
}
