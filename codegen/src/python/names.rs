//! Converts names of the description languages into names of Python.
//!
//! Classes are `UpperCamelCase`, constants `UPPER_CASE`, everything else is
//! `snake_case`. Keywords of Python and names that generated code uses itself get a `_` at the end.
//! The wire keeps the names of the IDSL.

use crate::component_names;
use crate::type_names;
use heck::ToSnakeCase;
use rc_python_names::{BUILTINS, KEYWORDS, clear, plain};
pub(crate) use rc_python_names::{
    exception_member, member, method, parameter, shout, snake, tuple_member,
};

/// Modules that generated modules import under these names, with a `_` before them.
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

/// Members of every context.
const OF_CONTEXT: [&str; 19] = [
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
    "set_parameter",
    "set_period",
    "state",
    "stop",
    "time",
    "time_source",
    "tree",
];

/// Members of every context of a test, in addition to the fakes of the slots.
const OF_TESTS: [&str; 12] = [
    "advance",
    "answer_defaults",
    "ctx",
    "link",
    "list_members",
    "now",
    "requested_parameters",
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

/// A member of the parameters.
pub(crate) fn parameter_member(name: &str) -> String {
    clear(plain(name), &[&BUILTINS, &["from_values"]])
}

/// A module.
pub(crate) fn module(name: &str) -> String {
    clear(plain(name), &[&IMPORTS])
}

/// A class. A name that could be one already stays as it is.
pub(crate) fn class(name: &str) -> String {
    clear(type_names::camel(name), &[])
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

/// Whether a file of the worker with this name would hide a module of Python, or of the framework:
/// `src` is the first folder in the search path.
pub(super) fn hides_module(stem: &str) -> bool {
    STANDARD.lines().any(|module| module == stem) || ["numpy", "robocomp"].contains(&stem)
}

/// Whether a component can have this name, which is that of its package.
///
/// # Errors
/// The reason for which it cannot.
pub(crate) fn component(name: &str) -> Result<(), &'static str> {
    let package = package(name);
    component_names::fits(name)?;
    if KEYWORDS.contains(&package.as_str()) || KEYWORDS.contains(&name) {
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
        assert_eq!(module("np"), "np_");
        assert_eq!(module("Typing"), "typing_");
        assert_eq!(class("datasayin"), "Datasayin");
        assert_eq!(class("RGBDParams"), "RGBDParams");
        assert_eq!(class("none"), "None_");
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
