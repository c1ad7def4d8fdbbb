//! The rules of ROS 2 for names (REP 2003, and what `rosidl` refuses).

use heck::{ToShoutySnakeCase, ToSnakeCase, ToUpperCamelCase};
use std::collections::HashSet;
use std::sync::LazyLock;

/// Words that cannot be names of fields, types or constants, since `rosidl` makes members of C, C++ and Python of these.
static WORDS: LazyLock<HashSet<&str>> = LazyLock::new(|| {
    let lines = include_str!("words.txt").lines();
    let words = lines.filter(|line| !line.starts_with('#'));
    words.flat_map(str::split_whitespace).collect()
});

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
    if WORDS.contains(&shout.as_str()) {
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
    if WORDS.contains(&camel.as_str()) {
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
}
