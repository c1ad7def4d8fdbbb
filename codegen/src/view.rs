//! The content of a generation, neutral of the language of its output: names of the description
//! languages, types, operations, facts. [`crate::rust`] adds the names of Rust; templates hold all
//! code.

pub(crate) mod checks;
pub mod component;
mod description;
pub(crate) mod documentation;
pub(crate) mod in_place;
pub mod library;
pub mod machine;
pub mod members;
pub mod parameters;
pub(crate) mod rpc_hash;
pub mod types;
pub mod world;

pub use component::{Component, Slot};
pub use machine::Machine;
pub use parameters::{Parameter, Parameters};
