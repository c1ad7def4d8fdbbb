//! Whole networks of the components of this repository.

mod groups;
mod patrol;
mod python;
mod site;
mod strangers;
mod swap;
