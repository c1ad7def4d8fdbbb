//! PDSL: the parameters of a component, and the configurations that give them values.
//!
//! [`parse`] turns one `.pdsl` text into a tree ([`ast`]), [`load`] resolves it with all that it imports into the
//! [`model`], and [`config`] reads a TOML file by that model, its rules included ([`condition`]). Without the
//! feature `language` there are only `model`, `condition` and `config`: what a robot's component needs, which
//! carries its model in its own code. `src/grammar.md` tells people what can be written.

#[cfg(feature = "language")]
pub mod ast;
pub mod condition;
pub mod config;
#[cfg(feature = "language")]
mod imports;
#[cfg(feature = "language")]
mod limits;
pub mod model;
#[cfg(feature = "language")]
mod parse;
#[cfg(feature = "language")]
mod resolve;
#[cfg(feature = "language")]
mod rules;

pub use config::{Configuration, Values};
pub use model::Parameters;
#[cfg(feature = "language")]
pub use parse::parse;
#[cfg(feature = "language")]
pub use resolve::load;

#[cfg(feature = "language")]
/// The layout of a `.pdsl`.
pub const STYLE: rc_syntax::Style = rc_syntax::Style {
    angle_brackets: false,
    enum_blocks: false,
    inline_braces_from: None,
};
