//! What every tool of this project says about a text: where, how bad, what is wrong, and what would be right.
//!
//! [`SourceMap`] owns the texts, a [`Span`] is a place in one of them, a [`Diagnostic`] is one finding,
//! and [`render`] turns findings into text. Nothing here knows any of the languages.

mod diagnostic;
mod duration;
mod nearest;
pub mod render;
mod source;

pub use diagnostic::{Diagnostic, Diagnostics, Label, Severity};
pub use duration::{duration_nanoseconds, duration_text};
pub use nearest::nearest;
pub use render::{Format, render};
pub use source::{Position, SourceId, SourceMap, Span};
