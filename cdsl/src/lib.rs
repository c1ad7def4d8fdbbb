//! CDSL: one component, what it communicates and how it is built.
//!
//! [`parse`] turns one text into a tree ([`ast`]); [`load`] also loads the interfaces that it imports and
//! resolves everything into the [`model`].

pub mod ast;
pub mod model;
mod parse;
mod resolve;

pub use model::Component;
pub use parse::parse;
pub use resolve::load;

/// The layout of a `.cdsl`.
pub const STYLE: rc_syntax::Style = rc_syntax::Style {
    angle_brackets: false,
    enum_blocks: false,
    inline_braces_from: Some(2),
};
