//! CDSL: a component, its interfaces and how it is built.
//!
//! [`parse`] turns one text into a syntax tree ([`ast`]). [`load`] also loads the imported
//! interfaces and resolves all names into the [`model`]; [`meanings`] reads its data prototypes.
//!
#![doc = include_str!("example.md")]

pub mod ast;
mod meanings;
pub mod model;
mod parse;
mod python;
mod qos;
mod resolve;
mod resolver;
mod slot_names;
mod window;

pub use meanings::meanings;
pub use model::Component;
pub use parse::parse;
pub use qos::settings;
pub use resolve::load;

/// The formatting options of `.cdsl` files.
pub const STYLE: rc_syntax::Style = rc_syntax::Style {
    angle_brackets: false,
    enum_blocks: false,
    inline_braces_from: Some(2),
};
