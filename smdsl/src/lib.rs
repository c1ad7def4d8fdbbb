//! SMDSL: the states of a component and the ways between them.
//!
//! [`parse`] turns one `.smdsl` text into a tree ([`ast`]), [`load`] resolves it into the [`model`] and checks
//! it. [`scxml`] reads a part of W3C SCXML into the same model.

pub mod ast;
mod builder;
mod check;
pub mod model;
mod parse;
mod resolve;
pub mod scxml;

pub use model::StateMachine;
pub use parse::parse;

use rc_diagnostics::{Diagnostics, SourceId, SourceMap};

/// Reads, resolves and checks one state machine: SCXML where the file's name ends so, SMDSL otherwise. There is
/// a machine unless the text could not be read at all; it may be used only where no diagnostic is an error.
pub fn load(sources: &SourceMap, source: SourceId) -> (Option<StateMachine>, Diagnostics) {
    let ending = sources.path(source).extension();
    if ending.is_some_and(|e| e.eq_ignore_ascii_case("scxml")) {
        scxml::load(sources, source)
    } else {
        resolve::load(sources, source)
    }
}

/// The layout of a `.smdsl`.
pub const STYLE: rc_syntax::Style = rc_syntax::Style {
    angle_brackets: false,
    enum_blocks: false,
    inline_braces_from: None,
};
