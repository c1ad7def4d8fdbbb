//! Whole networks of the components of this repository.

mod camera;
mod groups;
mod late;
mod patrol;
mod python;
mod site;
mod strangers;
mod swap;
