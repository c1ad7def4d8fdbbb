//! Vectors and maps whose versions share what did not change, as InnerModel and the property graph
//! keep them. A clone costs a few counts, a change copies a few small pages, and a reader of an
//! earlier version never sees it.

mod ids;
mod pages;

pub use ids::Ids;
pub use pages::Pages;
