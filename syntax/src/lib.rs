//! The parts of a front end that the five languages share: comments, literals, syntax errors,
//! imports and the formatter.
//!
//! `common.pest` is the shared part of the grammars. Each parser includes it before its own rules.
//!
#![doc = include_str!("example.md")]

mod format;
mod import_edit;
mod lexical;
mod literal;
mod loader;
mod parse_context;
mod scan;
mod syntax_error;
mod trivia;
mod unit;

pub use format::{Style, Token, TokenKind, format, tokens, with_ends_of};
pub use import_edit::import_edit;
pub use literal::{Literal, LiteralKind, unescape};
pub use loader::{Beside, ImportError, ImportedFile, Loader, MemoryLoader, home_in_path};
pub use parse_context::{Language, ParseContext, Terminal};
pub use trivia::Trivia;
pub use unit::unknown_unit;

pub use rc_diagnostics::Name;
