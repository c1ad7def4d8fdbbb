//! PDSL: the language that declares the parameters of a component.
//!
//! [`parse`] turns one `.pdsl` text into a tree ([`ast`]), and [`load`] resolves it with all that it imports into
//! the model of `rc_configuration`, which checks configurations by it. `src/grammar.md` tells people what can be
//! written.

pub mod ast;
mod conditions;
mod imports;
mod limits;
mod parse;
mod resolve;

pub use parse::parse;
pub use resolve::load;

/// The layout of a `.pdsl`.
pub const STYLE: rc_syntax::Style = rc_syntax::Style {
    angle_brackets: false,
    enum_blocks: false,
    inline_braces_from: None,
};
