//! From description files to a component's Rust.
//!
//! [`project::Project::load`] reads a `.cdsl` with all that it names; [`view`] lists what to print,
//! independently of the printed language; [`rust`] and [`python`] add the names and types of a
//! language; templates contain the code; [`files::Files`] is the result in memory, written in one
//! place, all or nothing. [`stubs`] finds the handlers that a worker lacks after its description
//! changed; [`export`] writes interfaces in languages of other frameworks.

pub mod cargo_workspace;
mod collisions;
mod component_names;
pub mod configuration;
pub mod copied;
mod cpp;
pub mod dependencies;
pub mod description;
pub mod export;
pub mod files;
pub mod from_robocomp;
pub mod generate;
pub mod generation;
mod generator;
pub mod installed;
pub mod interface_crate;
mod kinematics;
pub mod load;
mod machine_names;
mod markdown;
pub mod new_component;
pub mod note;
pub mod origin;
mod packages;
pub mod parallel;
pub mod paths;
mod program;
pub mod project;
pub mod proxies;
pub mod purpose;
pub mod python;
mod requirements;
pub mod ros;
pub mod rust;
pub mod source_files;
pub mod stubs;
pub mod templates;
mod type_names;
pub mod view;
mod viewer;
pub mod worker;
pub mod workspace;
pub mod world;
mod world_types;

pub use files::Files;
pub use load::FileLoader;
pub use project::Project;
pub use rust::names;
