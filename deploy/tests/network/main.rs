//! Whole networks of the components of this repository.

mod camera;
mod groups;
mod joints;
mod late;
mod params;
mod patrol;
mod probe;
mod python;
mod settings;
mod site;
#[path = "../bench/skipped.rs"]
mod skipped;
mod strangers;
mod swap;
mod variant;
