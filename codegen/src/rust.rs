//! What Rust calls the things of a view, and how its code is laid out. A view says what there is; the templates in
//! `templates/rust` hold the code.

mod collisions;
pub(crate) mod component;
mod documentation;
mod exports;
mod handlers;
mod in_place;
mod layout;
pub(crate) mod library;
pub(crate) mod machine;
pub mod names;
mod operation_names;
mod parameters;
pub(crate) mod print;
mod testing;
mod types;
pub mod worker;

pub(crate) use collisions::check;
