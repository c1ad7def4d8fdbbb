//! Data prototypes: the meanings of the values of a type. A prototype names the meaning, the
//! coordinates, the type that holds the numbers, their units and axes.
//!
//! [`parse`] turns one `.dproto` text into a syntax tree ([`ast`]), [`format()`] prints it. [`load`]
//! loads a text with its imports, and resolves all names: a [`Library`](model::Library).
//! [`GEOMETRY`] is the domain that comes with this crate.
//!
#![doc = include_str!("example.md")]

pub mod ast;
mod fields;
mod format;
mod geometry;
mod imports;
mod interface;
mod maps;
pub mod model;
mod parse;
mod resolve;
mod roles;

pub use format::format;
pub use geometry::{COORDINATES, Coordinate, GEOMETRY, Semantic, coordinate, listing, semantic};
pub use parse::parse;
pub use resolve::{FIELDS, import, load};
