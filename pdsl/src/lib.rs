//! PDSL: the parameters of a component, and the configurations that give them values.
//!
//! [`parse`] turns one `.pdsl` text into a tree ([`ast`]), [`load`] resolves it into the [`model`], and
//! [`config`] reads a TOML file by that model. Without the feature `language` there are only `model` and
//! `config`: what a robot's component needs, which carries its model in its own code.

#[cfg(feature = "language")]
pub mod ast;
pub mod config;
pub mod model;
#[cfg(feature = "language")]
mod parse;
#[cfg(feature = "language")]
mod resolve;

pub use config::{Configuration, Values};
pub use model::Parameters;
#[cfg(feature = "language")]
pub use parse::parse;
#[cfg(feature = "language")]
pub use resolve::load;

#[cfg(feature = "language")]
/// The layout of a `.pdsl`.
pub const STYLE: rc_syntax::Style = rc_syntax::Style {
    angles: false,
    enumerations: false,
    settings_from: None,
};
