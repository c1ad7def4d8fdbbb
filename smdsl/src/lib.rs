//! SMDSL: the state machine of a component.
//!
//! [`parse`] turns one `.smdsl` text into a syntax tree ([`ast`]). [`load`] resolves it into the
//! [`model`] and checks it. [`scxml`] reads a subset of W3C SCXML into the same model. [`tables`]
//! converts the model into the tables of the interpreter (`rc_machine`).
//!
#![doc = include_str!("example.md")]

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

use rc_diagnostics::{Diagnostic, Diagnostics, SourceId, SourceMap, Span};

/// Loads and checks a state machine: SCXML if the file has the extension `scxml`, otherwise SMDSL.
///
/// Returns no machine if the text cannot be parsed at all. Use the machine only if no diagnostic is
/// an error.
pub fn load(sources: &SourceMap, source: SourceId) -> (Option<StateMachine>, Diagnostics) {
    let extension = sources.path(source).extension();
    let is_scxml = extension.is_some_and(|e| e.eq_ignore_ascii_case("scxml"));
    if let Some(error) = other_format(sources, source, is_scxml) {
        let mut found = Diagnostics::new();
        found.push(error);
        return (None, found);
    }
    if is_scxml {
        scxml::load(sources, source)
    } else {
        resolve::load(sources, source)
    }
}

/// Reports a text of the other language. Only SCXML begins with `<`, and only SMDSL with a letter,
/// a `:` or a comment.
fn other_format(sources: &SourceMap, source: SourceId, is_scxml: bool) -> Option<Diagnostic> {
    let text = sources.text(source);
    let start = text.find(|c: char| !c.is_whitespace() && c != '\u{feff}')?;
    let first = text[start..].chars().next()?;
    let is_smdsl = first.is_alphabetic() || matches!(first, ':' | '/' | '_');
    let (found, expected, extension) = match first {
        '<' if !is_scxml => ("SCXML", "SMDSL", "scxml"),
        _ if is_smdsl && is_scxml => ("SMDSL", "SCXML", "smdsl"),
        _ => return None,
    };
    let span = Span::new(source, start, start + first.len_utf8());
    let message = format!("expected {expected}, found {found}");
    let name = sources.path(source).with_extension(extension);
    let name = name.file_name().unwrap_or_default().to_string_lossy();
    let help = format!("name the file `{name}`");
    Some(Diagnostic::error("other-format", span, message).help(help))
}

/// The formatting options of `.smdsl` files.
pub const STYLE: rc_syntax::Style = rc_syntax::Style {
    angle_brackets: false,
    enum_blocks: false,
    inline_braces_from: None,
};
