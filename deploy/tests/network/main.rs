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
mod strangers;
mod swap;
mod variant;
