//! What the five languages share: comments and documentation, literals, semicolons, the explanation of what
//! pest could not read, and the way in which texts that import each other are found.
//!
//! The shared part of the grammars is `common.pest`, which every language's parser includes before its own.

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
pub use rc_diagnostics::duration_nanoseconds;
pub use trivia::Trivia;

use rc_diagnostics::Span;

/// A name and where it stands.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Name {
    /// The name as written.
    pub text: String,
    /// Its place.
    pub span: Span,
}

impl Name {
    /// A name at a place.
    pub fn new(text: impl Into<String>, span: Span) -> Self {
        Self {
            text: text.into(),
            span,
        }
    }
}
