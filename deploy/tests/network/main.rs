//! Whole networks of the components of this repository.

mod camera;
mod groups;
mod joints;
mod late;
#[path = "../outside/mod.rs"]
mod outside;
mod params;
mod patrol;
mod python;
mod site;
mod strangers;
mod swap;
