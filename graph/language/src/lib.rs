//! GDSL: the types of a property graph.
//!
//! [`parse`] turns one `.gdsl` text into a syntax tree ([`ast`]). [`load`] loads a text with its
//! imports, also of data prototypes, resolves all names and makes a [`Schema`] of it; [`import`] does so
//! for one that a file of another language names. [`DOMAINS`] come with this crate.
//!
#![doc = include_str!("example.md")]

pub mod ast;
mod blocks;
mod consistency;
mod imports;
mod members;
mod parse;
mod resolve;
mod rules;
mod units;

pub use graph_schema as model;
pub use graph_schema::Schema;
pub use members::TYPES;
pub use parse::parse;
pub use resolve::{import, load};

/// Domains that every file may import: name of the file, and text.
pub const DOMAINS: [(&str, &str); 5] = [
    ("geometry.gdsl", include_str!("../domains/geometry.gdsl")),
    (
        "kinematics.gdsl",
        include_str!("../domains/kinematics.gdsl"),
    ),
    (
        "measurement.gdsl",
        include_str!("../domains/measurement.gdsl"),
    ),
    ("dsr.gdsl", include_str!("../domains/dsr.gdsl")),
    (
        "innermodel.gdsl",
        include_str!("../domains/innermodel.gdsl"),
    ),
];

/// A domain that comes with this crate.
///
/// # Panics
/// Never: a test loads all of them.
pub fn builtin(name: &str) -> Option<Schema> {
    let text = DOMAINS.iter().find(|(file, _)| *file == name)?.1;
    let mut sources = rc_diagnostics::SourceMap::new();
    let source = sources.add(name, text);
    load(&mut sources, &rc_syntax::MemoryLoader::default(), source).0
}

/// The formatting options of `.gdsl` files.
pub const STYLE: rc_syntax::Style = rc_syntax::Style {
    angle_brackets: false,
    enum_blocks: false,
    inline_braces_from: None,
};
