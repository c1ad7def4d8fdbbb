//! Configurations of components: TOML files, read by the model of the component's parameters.
//!
//! `[component]`, `[bindings]` and `[middleware.NAME]` belong to the framework, `[parameters]` to
//! the `.pdsl`. A component links this crate and carries its [`model`] in its own code. [`check`]
//! reads a file, [`LiveParameters`] checks changes of a running component and saves them. The
//! feature `tools` adds what only tools need: the template, the schema and the update of a
//! configuration.
//!
#![doc = include_str!("example.md")]

mod block;
mod change;
mod check;
mod checker;
pub mod condition;
mod document;
mod edit;
mod live;
mod middleware;
pub mod model;
mod parameters;
mod path;
mod record;
mod rules;
mod save;
#[cfg(feature = "tools")]
mod schema;
#[cfg(feature = "tools")]
mod template;
mod untyped_value;
#[cfg(feature = "tools")]
mod update;
mod value;
mod values;

pub use change::ParamChange;
#[cfg(feature = "tools")]
pub use check::violations_by_defaults;
pub use check::{
    Binding, Configuration, check, check_readable, check_with, defaults, defaults_with,
};
#[cfg(feature = "tools")]
pub use document::keys;
pub use document::{parse_argument, parse_document};
pub use live::{CheckedChanges, LiveParameter, LiveParameters};
pub use middleware::{Setting, Settings};
pub use model::Parameters;
pub use rules::violations_by;
pub use save::SaveError;
#[cfg(feature = "tools")]
pub use schema::{Slot, json_text, schema};
#[cfg(feature = "tools")]
pub use template::template;
pub use untyped_value::UntypedValue;
#[cfg(feature = "tools")]
pub use update::{Change, ChangeKind, Update, unset_parameters, update};
pub use values::{Field, PathFolders, Values, folder_of_paths};
