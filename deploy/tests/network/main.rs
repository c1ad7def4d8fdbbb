//! Whole networks of the components of this repository.

mod groups;
mod joints;
mod patrol;
mod site;
mod swap;
