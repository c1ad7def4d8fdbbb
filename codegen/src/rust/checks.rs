//! The statements that check bounds and ranges where values are written and read.

use crate::view::checks::{Check, Elements, is_long};
use crate::view::members::Member;

/// The subject of a check: its variable, and the end of a statement.
#[derive(Clone, Copy)]
pub(super) struct Side {
    port: &'static str,
    end: &'static str,
}

/// A writer keeps its first error.
pub(super) const WRITES: Side = Side {
    port: "writer",
    end: ";",
};

/// A reader returns its first error.
pub(super) const READS: Side = Side {
    port: "reader",
    end: "?;",
};

/// How code holds the checked value.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum ValuePlace {
    /// In a variable or a field.
    Owned,
    /// As the argument of a client's function: numbers by value, all else by reference.
    Argument,
    /// After a reference.
    Behind,
}

/// A value of a message, with the name that errors have for it.
#[derive(Clone, Copy)]
pub(super) struct Place<'a> {
    pub(super) what: &'a str,
    pub(super) name: &'a str,
    pub(super) held: ValuePlace,
}

impl Place<'_> {
    fn reference(self) -> String {
        let mark = if self.held == ValuePlace::Owned {
            "&"
        } else {
            ""
        };
        format!("{mark}{}", self.name)
    }

    fn number(self) -> String {
        let mark = if self.held == ValuePlace::Behind {
            "*"
        } else {
            ""
        };
        format!("{mark}{}", self.name)
    }
}

/// The statements for a value, one in a line.
pub(super) fn of(checks: &[Check], place: Place, side: Side) -> String {
    let mut lines = Vec::new();
    write(checks, place, side, &mut lines);
    lines.join("\n")
}

/// The statements for an optional value: `present` is the option with it.
pub(super) fn of_present(checks: &[Check], present: &str, what: &str, side: Side) -> String {
    let place = Place {
        what,
        name: "item",
        held: ValuePlace::Behind,
    };
    let inside = of(checks, place, side);
    if inside.is_empty() {
        inside
    } else {
        format!("if let Some(item) = {present} {{\n{inside}\n}}")
    }
}

/// The statements for a member or a parameter.
pub(super) fn of_member(member: &Member, place: Place, side: Side) -> String {
    if member.optional {
        of_present(&member.checks, &place.reference(), place.what, side)
    } else {
        of(&member.checks, place, side)
    }
}

fn write(checks: &[Check], place: Place, side: Side, lines: &mut Vec<String>) {
    let Side { port, end } = side;
    let Place { what, name, .. } = place;
    for check in checks {
        match check {
            Check::Bound { bound } => lines.push(format!(
                "{port}.bound(\"{what}\", {name}.len(), {bound}){end}"
            )),
            Check::Range {
                primitive,
                min,
                max,
                text,
            } => {
                let number = place.number();
                let (function, ty, least, most) = if is_long(*primitive) {
                    ("integer_range", "i128", "MIN", "MAX")
                } else {
                    ("range", "f64", "NEG_INFINITY", "INFINITY")
                };
                let number = if primitive.rust() == ty {
                    number
                } else {
                    format!("{ty}::from({number})")
                };
                let end_of = |value: &Option<String>, none: &str| {
                    let none = || format!("{ty}::{none}");
                    value.clone().unwrap_or_else(none)
                };
                let (min, max) = (end_of(min, least), end_of(max, most));
                lines.push(format!(
                    "{port}.{function}(\"{what}\", {number}, ({min}, {max}), \"{text}\"){end}"
                ));
            }
            Check::Each { of, checks } => {
                let all = match of {
                    Elements::Items => place.reference(),
                    Elements::Keys => format!("{name}.keys()"),
                    Elements::Values => format!("{name}.values()"),
                };
                lines.push(format!("for item in {all} {{"));
                let item = Place {
                    what,
                    name: "item",
                    held: ValuePlace::Behind,
                };
                write(checks, item, side, lines);
                lines.push("}".to_owned());
            }
        }
    }
}
