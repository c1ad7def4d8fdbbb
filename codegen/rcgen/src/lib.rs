//! What the program `rcgen` does with files, beside printing components: [`check`] judges files of
//! any description language, [`format`](mod@format) lays them out, [`mend`] does
//! what findings suggest, [`server`] is all of it for editors, and [`explain`] has a page for each finding.
//!
//! It knows all languages, so the graph and InnerModel as well. Nothing that starts components links it.

pub mod check;
pub mod explain;
pub mod format;
pub mod graphs;
pub mod innermodel;
pub mod languages;
pub mod mend;
pub mod server;
