//! Whole networks of the components of this repository.

mod camera;
mod groups;
mod patrol;
mod site;
mod swap;
