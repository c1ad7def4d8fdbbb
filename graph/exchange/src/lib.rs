//! Files of graphs: `.graph` of ours and DSR's JSON, both ways; `GraphML` and Turtle out; InnerModel and
//! URDF in.
//!
//! A file becomes a [`Document`], which [`check`] compares with a schema, with the place of each
//! finding, and [`Document::graph`] makes a graph of. Reading does not keep places: if there is a
//! finding, the text is scanned once more for them.
//!
#![doc = include_str!("example.md")]

mod check;
mod document;
pub mod dsr;
pub mod graph_json;
pub mod graphml;
mod hints;
pub mod innermodel;
mod json;
mod migration;
mod older;
mod part;
mod places;
mod reflection;
pub mod robot;
pub mod shapes;
pub mod turtle;

pub use check::check;
pub use document::{Attribute, Document, Edge, Node, lenient};
pub use json::add;
pub use migration::{Migration, migrate};
pub use part::{JoinError, domains};
pub use property_graph::Id;
