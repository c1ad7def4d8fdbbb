//! Diagnostics about source texts, shared by all languages and tools of this project.
//!
//! [`SourceMap`] owns the texts, a [`Span`] is a byte range in one of them, and [`render`] prints
//! [`Diagnostics`]. This crate knows none of the languages. [`foreign`] cleans text from
//! outside, [`xml`] escapes it, and [`print`] is how the tools print.

mod characters;
mod diagnostic;
pub mod fix;
pub mod foreign;
mod nearest;
pub mod print;
pub mod render;
mod source;
pub mod xml;

pub use characters::stray_character;
pub use diagnostic::{Diagnostic, Diagnostics, Label, Severity};
pub use fix::{Edit, Fix};
pub use nearest::nearest;
pub use render::{Format, render, render_for};
pub use source::{Name, Position, SourceId, SourceMap, Span};
