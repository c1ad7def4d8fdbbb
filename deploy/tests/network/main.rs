//! Whole networks of the components of this repository.

mod groups;
mod params;
mod patrol;
mod site;
mod swap;
