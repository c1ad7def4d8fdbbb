//! The parts of a front end that the five languages share: comments, literals, syntax errors,
//! imports and the formatter.
//!
//! `common.pest` is the shared part of the grammars. Each parser includes it before its own rules.

mod format;
mod literal;
mod loader;
mod parse_context;
mod scan;
mod syntax_error;
mod trivia;

pub use format::{Style, format};
pub use literal::{Literal, LiteralKind, unescape};
pub use loader::{ImportError, ImportedFile, Loader, MemoryLoader};
pub use parse_context::{Language, ParseContext, Terminal};
pub use trivia::Trivia;

use rc_diagnostics::Span;

/// A name or another piece of text, with its location.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Name {
    /// The text as written; the content of a string.
    pub text: String,
    /// The location.
    pub span: Span,
}

impl Name {
    /// A name at a location.
    pub fn new(text: impl Into<String>, span: Span) -> Self {
        Self {
            text: text.into(),
            span,
        }
    }
}
