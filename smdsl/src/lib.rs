//! SMDSL: the state machine of a component.
//!
//! [`parse`] turns one `.smdsl` text into a syntax tree ([`ast`]). [`load`] resolves it into the
//! [`model`] and checks it. [`scxml`] reads a subset of W3C SCXML into the same model. [`tables`]
//! makes of it what the interpreter (`rc_machine`) runs.

pub mod ast;
mod builder;
mod check;
pub mod model;
mod parse;
mod resolve;
pub mod scxml;
pub mod tables;

pub use model::StateMachine;
pub use parse::parse;

use rc_diagnostics::{Diagnostics, SourceId, SourceMap};

/// Loads and checks a state machine: SCXML if the file has the extension `scxml`, otherwise SMDSL.
///
/// Returns no machine if the text cannot be parsed at all. Use the machine only if no diagnostic is
/// an error.
pub fn load(sources: &SourceMap, source: SourceId) -> (Option<StateMachine>, Diagnostics) {
    let extension = sources.path(source).extension();
    if extension.is_some_and(|e| e.eq_ignore_ascii_case("scxml")) {
        scxml::load(sources, source)
    } else {
        resolve::load(sources, source)
    }
}

/// The formatting options of `.smdsl` files.
pub const STYLE: rc_syntax::Style = rc_syntax::Style {
    angle_brackets: false,
    enum_blocks: false,
    inline_braces_from: None,
};
