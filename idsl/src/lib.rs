//! IDSL: the interfaces of components and their data types.
//!
//! [`parse`] turns one text into a syntax tree ([`ast`]). [`Session`] loads a text with its imports
//! and resolves all names into the [`model`]. [`canonical`] computes the hashes by which two ends
//! of a connection compare their types. The grammar is `src/grammar.pest`, after `common.pest` of
//! the crate `syntax`.
//!
#![doc = include_str!("example.md")]

mod annotations;
pub mod ast;
pub mod canonical;
mod check;
pub mod in_place;
mod lookup;
pub mod model;
mod parse;
mod resolve;
mod resolver;
mod session;

pub use model::Library;
pub use parse::parse;
pub use session::Session;

/// The formatting options of `.idsl` files.
pub const STYLE: rc_syntax::Style = rc_syntax::Style {
    angle_brackets: true,
    enum_blocks: true,
    inline_braces_from: None,
};
