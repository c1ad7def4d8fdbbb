//! From description files to a component's Rust.
//!
//! [`project::Project::load`] reads a `.cdsl` with all that it names; [`view`] decides every name, type and
//! line; the templates only print what the view says; [`files::Files`] is the result in memory, written in one
//! place, all or nothing. [`stubs`] says what a worker that exists lacks after its description changed;
//! [`export`] writes interfaces in the languages of others.

pub mod cargo_workspace;
pub mod check;
pub mod configuration;
mod dependencies;
pub mod explain;
pub mod export;
pub mod files;
pub mod format;
pub mod generate;
pub mod languages;
pub mod layout;
pub mod load;
pub mod names;
pub mod note;
pub mod project;
pub mod ros;
pub mod stubs;
pub mod view;
pub mod workspace;

pub use files::Files;
pub use load::FileLoader;
pub use project::Project;
