//! Draws property graphs and their schemas: as SVG, and as text for Graphviz.
//!
//! [`of_graph`] and [`of_schema`] make a [`Picture`] of boxes with rows, where lines begin.
//! [`Picture::svg`] and [`Picture::dot`] draw it. Equal input gives equal text.
//!
#![doc = include_str!("example.md")]

mod dot;
mod graph;
mod schema;
mod svg;
#[cfg(test)]
mod tests;

pub use graph::of_graph;
use rc_diagnostics::foreign;
pub use schema::of_schema;
use thiserror::Error;

/// How many boxes and lines an SVG has at most. The layout takes seconds for as many, and a larger
/// picture is unreadable.
pub const MOST: usize = 4096;

/// The graph has too many nodes or edges for an SVG.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
#[error("an SVG has at most {MOST} boxes and lines, and this one would have {0}")]
pub struct TooLarge(pub usize);

/// Boxes and lines between them.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    title: String,
    boxes: Vec<Box>,
}

/// A node of a graph, or an entity of a schema.
#[derive(Clone, Debug, Default, PartialEq)]
struct Box {
    name: String,
    /// After the name.
    kind: String,
    /// All about it, a line each.
    tooltip: Vec<String>,
    rows: Vec<Row>,
}

/// A line of text in a box. Lines to other boxes begin at its right end.
#[derive(Clone, Debug, Default, PartialEq)]
struct Row {
    text: String,
    /// The other boxes, and the tooltips of the lines.
    ends: Vec<(usize, String)>,
    /// Whether the lines show inheritance.
    is_parent: bool,
}

/// The longest text of a row or a name, in characters.
const LONGEST: usize = 60;

/// A text that fits into a row. Characters that a terminal or a reader could misinterpret are
/// replaced.
fn short(text: &str) -> String {
    let text = foreign::clean(text);
    if text.chars().count() <= LONGEST {
        return text;
    }
    text.chars().take(LONGEST - 1).chain(['…']).collect()
}
