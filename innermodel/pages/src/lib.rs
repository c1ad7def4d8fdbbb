//! Vectors and maps whose versions share what did not change, as InnerModel and the property graph
//! keep them. A clone costs a few counts, a change copies a few small pages, and a reader of an
//! earlier version never sees it. [`Versions`] keeps the last ones by their times.
//!
#![doc = include_str!("example.md")]

mod ids;
mod pages;
mod versions;

pub use ids::Ids;
pub use pages::Pages;
pub use versions::{Timed, Versions};
