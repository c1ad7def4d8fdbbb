//! Texts of units, which several languages have.

use rc_diagnostics::{Diagnostic, Span};
use rc_quantity::{Unit, UnitProblem};

/// A warning about the text of a unit that is in no table: such units are compared as texts only,
/// and never converted. `None` if the unit is known.
pub fn unknown_unit(text: &str, span: Span) -> Option<Diagnostic> {
    let error = Unit::parse(text).err()?;
    let part = text.get(error.range.clone()).unwrap_or(text);
    let message = match error.problem {
        UnitProblem::Unknown if part == text => format!("unknown unit `{text}`"),
        UnitProblem::Unknown => format!("unknown unit `{part}` in `{text}`"),
        problem => format!("`{text}` is not a unit: {problem}"),
    };
    let warning = Diagnostic::warning("unknown-unit", span, message);
    Some(match error.problem {
        UnitProblem::Unknown => warning.suggest(part, rc_quantity::names()),
        _ => warning.help("write units like `mm`, `m/s^2`, `kg*m^2`, `deg`, `%` or `1/s`"),
    })
}
