//! Diagnostics about source texts, shared by all languages and tools of this project.
//!
//! [`SourceMap`] owns the texts, a [`Span`] is a byte range in one of them, and [`render()`] prints
//! [`Diagnostics`]. This crate knows none of the languages. [`foreign`] cleans text from
//! outside, [`xml`] escapes it, and [`mod@print`] is how the tools print.
//!
//! # Example
//!
//! ```
//! use rc_diagnostics::{Diagnostic, Diagnostics, Format, SourceMap, Span, render};
//!
//! let mut sources = SourceMap::new();
//! let source = sources.add("a.idsl", "modul M {};");
//! let mut found = Diagnostics::new();
//! found.push(Diagnostic::error("syntax", Span::new(source, 0, 5), "expected `module`"));
//! let text = render(&sources, &found, Format::Short);
//! assert!(text.starts_with("a.idsl:1:1: error[syntax]: expected `module`"));
//! ```

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
