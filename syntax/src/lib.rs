//! What the five languages share: comments and documentation, literals, semicolons, the explanation of what
//! pest could not read, and the way in which texts that import each other are found.
//!
//! The shared part of the grammars is `common.pest`, which every language's parser includes before its own.

mod explain;
mod literal;
mod loader;
mod trivia;

pub use explain::{explain, nesting};
pub use literal::{Literal, LiteralKind, unescape};
pub use loader::{Found, Loader, MemoryLoader, NotFound};
pub use rc_diagnostics::duration_nanoseconds;
pub use trivia::Trivia;

use rc_diagnostics::{Diagnostic, SourceId, Span};

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

/// An error where a comment begins that has no end.
pub fn unclosed_comment(trivia: &Trivia, source: SourceId) -> Option<Diagnostic> {
    let at = trivia.unclosed()?;
    let message = "this comment has no end: `*/` is missing";
    let span = Span::new(source, at, at + 2);
    Some(Diagnostic::error("unclosed-comment", span, message))
}

/// The missing `;` after whatever ends before `at`.
pub fn missing_semicolon(trivia: &Trivia, source: SourceId, at: usize) -> Diagnostic {
    let end = trivia.end_of_token_before(at);
    Diagnostic::error(
        "missing-semicolon",
        Span::new(source, end, end),
        "`;` expected here",
    )
}
