//! The rules of ROS 2 for names (REP 2003, and what `rosidl` refuses).

use heck::{ToShoutySnakeCase, ToSnakeCase, ToUpperCamelCase};
use std::collections::HashSet;
use std::sync::LazyLock;

/// Reserved words. Fields, types and constants become members in C, C++ and Python, so they cannot
/// have these names.
static RESERVED_WORDS: LazyLock<HashSet<&str>> = LazyLock::new(|| {
    let lines = include_str!("words.txt").lines();
    let words = lines.filter(|line| !line.starts_with('#'));
    words.flat_map(str::split_whitespace).collect()
});

/// The name of a field: `[a-z][a-z0-9_]*`, without a final `_` and without `__`.
pub fn field(name: &str) -> String {
    let snake = with_leading_letter(&name.to_snake_case(), "n");
    if RESERVED_WORDS.contains(&snake.as_str()) {
        snake + "_value"
    } else {
        snake
    }
}

/// The name of a constant: as a field, in upper case.
pub fn constant(name: &str) -> String {
    let shout = with_leading_letter(&name.to_shouty_snake_case(), "N");
    if RESERVED_WORDS.contains(&shout.as_str()) {
        shout + "_VALUE"
    } else {
        shout
    }
}

/// A part of the name of a type. Converts to `CamelCase` only if necessary.
pub fn camel(name: &str) -> String {
    let (first, rest) = name.split_at(name.len().min(1));
    let camel = if first == "_" || rest.contains('_') {
        name.to_upper_camel_case()
    } else {
        first.to_uppercase() + rest
    };
    with_leading_letter(&camel, "N")
}

/// The name of a message or a service: `[A-Z][A-Za-z0-9]*`.
pub fn ty(name: &str) -> String {
    let camel = camel(name);
    if RESERVED_WORDS.contains(&camel.as_str()) {
        camel + "Type"
    } else {
        camel
    }
}

/// The package of a module: `RoboCompLaser` becomes `robocomp_laser_msgs`.
pub fn package(module: &str) -> String {
    let own = module
        .strip_prefix("RoboComp")
        .unwrap_or(module)
        .to_snake_case();
    let between = if own.is_empty() { "" } else { "_" };
    format!("robocomp{between}{own}_msgs")
}

/// Whether this is a valid name of a package.
pub fn is_package(name: &str) -> bool {
    let letters = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_';
    name.len() > 1
        && name.starts_with(|c: char| c.is_ascii_lowercase())
        && name.chars().all(letters)
        && !name.ends_with('_')
        && !name.contains("__")
}

/// Whether this is a valid name of a type.
pub fn is_type(name: &str) -> bool {
    name.starts_with(|c: char| c.is_ascii_uppercase())
        && name.chars().all(|c| c.is_ascii_alphanumeric())
}

/// Prepends `letter` to a name that does not begin with a letter.
fn with_leading_letter(name: &str, letter: &str) -> String {
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
        assert_eq!(constant("bigEndian"), "BIG_ENDIAN_VALUE");
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
    fn names_of_packages_and_fields_follow_the_rules_of_ros() {
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
}
