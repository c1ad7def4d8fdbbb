//! DDSL: a network of components.
//!
//! [`parse`] turns one text into a tree ([`ast`]); [`load`] also reads what it imports and resolves all of it into
//! the [`model`]; [`connect`] checks that against its components and says who talks to whom.

pub mod ast;
mod check;
mod compatibility;
mod connect;
mod exports;
mod fields;
mod graph;
mod imports;
pub mod model;
mod parse;
mod resolve;
mod settings;

pub use connect::{Connection, ConnectionDiagnostic, Endpoint, Network, connect};
pub use model::Deployment;
pub use parse::parse;
pub use resolve::load;

/// The layout of a `.ddsl`.
pub const STYLE: rc_syntax::Style = rc_syntax::Style {
    angle_brackets: false,
    enum_blocks: false,
    inline_braces_from: None,
};
