//! Whole networks of the components of this repository.

mod groups;
mod patrol;
mod site;
mod swap;
