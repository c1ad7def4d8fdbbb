//! DDSL: a network of components.
//!
//! [`parse`] turns one text into a syntax tree ([`ast`]). [`load`] also loads its imports and
//! resolves all names into the [`model`]. [`expand`] gives an instance its members of slot arrays.
//! [`proxied`] says what the proxy of a group forwards, and [`add_adaptors`] adds the components
//! that convert in a process of their own. [`connect`] checks the model against the components and
//! computes the connections.
//!
#![doc = include_str!("example.md")]

mod adaptors;
pub mod ast;
mod check;
mod compatibility;
mod connect;
pub mod conversion;
mod converted;
mod duplicates;
mod end;
mod endpoint;
mod exports;
mod fields;
mod graph;
mod host_address;
mod host_build;
mod image;
mod imports;
mod leaders;
pub mod link;
mod meaning;
mod members;
pub mod model;
mod moves;
mod network;
mod pair;
mod parse;
mod peers;
mod processor;
mod proxies;
mod resolve;
mod settings;
mod units;

pub use adaptors::{Adaptor, Origin, add_adaptors};
pub use connect::connect;
pub use endpoint::Endpoint;
pub use fields::is_own_option;
pub use members::expand;
pub use model::Deployment;
pub use network::{Connection, ConnectionDiagnostic, Network};
pub use parse::parse;
pub use proxies::proxied;
pub use resolve::load;

/// The formatting options of `.ddsl` files.
pub const STYLE: rc_syntax::Style = rc_syntax::Style {
    angle_brackets: false,
    enum_blocks: false,
    inline_braces_from: None,
};
