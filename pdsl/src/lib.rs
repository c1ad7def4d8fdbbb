//! PDSL: the language that declares the parameters of a component.
//!
//! [`parse`] parses one `.pdsl` text into a syntax tree ([`ast`]). [`load`] resolves it with its
//! imports into the model of `rc_configuration`, which checks configurations. `docs/pdsl.md`
//! documents the language for users.
//!
#![doc = include_str!("example.md")]

pub mod ast;
mod block;
pub mod condition;
mod conditions;
mod imports;
mod limits;
mod parse;
mod resolve;

pub use conditions::resolve_rules;
pub use parse::parse;
pub use resolve::load;

/// The layout of a `.pdsl` file.
pub const STYLE: rc_syntax::Style = rc_syntax::Style {
    angle_brackets: false,
    enum_blocks: false,
    inline_braces_from: None,
};
