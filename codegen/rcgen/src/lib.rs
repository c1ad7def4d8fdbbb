//! The work of the program `rcgen` on files, besides printing components: [`check`] checks files of
//! any description language, [`format`](mod@format) formats them, [`mod@fix`] applies the fixes of
//! findings, [`server`] offers all of it to editors, [`index`] lists what folders hold, [`robocomp`] takes over folders of RoboComp, and [`explain`] has a page for each finding.
//!
//! It knows all languages, so the graph and InnerModel as well. Nothing that starts components links it.

pub mod check;
pub mod explain;
pub mod fix;
pub mod format;
pub mod graphs;
pub mod index;
pub mod innermodel;
pub mod languages;
pub mod robocomp;
pub mod server;
