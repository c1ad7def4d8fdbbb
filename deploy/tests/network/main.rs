//! Whole networks of the components of this repository.

mod patrol;
mod site;
mod swap;
