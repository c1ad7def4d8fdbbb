//! DDSL: a network of components.
//!
//! [`parse`] turns one text into a [`model::Deployment`], checked in itself; [`connect`] checks it against its
//! components and says who talks to whom.

mod connect;
pub mod model;
mod parse;

pub use connect::{Connection, Endpoint, Network, connect};
pub use parse::parse;

/// The layout of a `.ddsl`.
pub const STYLE: rc_syntax::Style = rc_syntax::Style {
    angles: false,
    enumerations: false,
    settings_from: None,
};
