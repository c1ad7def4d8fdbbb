//! IDSL: the interfaces of components and the types of their data.
//!
//! [`parse`] turns one text into a tree ([`ast`]); [`Library::import`] loads a text and all that it imports,
//! and resolves every name into the [`model`]; [`canonical`] gives two equal things one hash.
//! The grammar is `src/grammar.pest`, after `common.pest` of the crate `syntax`.

pub mod ast;
pub mod canonical;
mod check;
pub mod image;
pub mod model;
mod parse;
mod resolve;
mod session;

pub use model::Library;
pub use parse::parse;
pub use session::Session;

/// The layout of a `.idsl`.
pub const STYLE: rc_syntax::Style = rc_syntax::Style {
    angle_brackets: true,
    enum_blocks: true,
    inline_braces_from: None,
};
