//! The vocabulary of all layers, each thing once: the types of the IDSL, the ends of a connection,
//! quality of service, middlewares with their settings, languages, restart policies, names.
//!
//! Each is a type of its own with its words and limits, in the form that files and messages have
//! (`serde`). The languages read them, generated code and components use them, tools print them.
//! Components link this crate, so it has no grammar and no heavy dependency.
//!
//! - [`address`]: addresses of slots.
//! - [`duration`]: durations as people write them.
//! - [`foreign`]: decodes texts of other processes.
//! - [`Kind`], [`Value`]: the values of a setting. Configurations, `.ddsl` files and command lines
//!   convert their texts once, by [`Kind::convert`] or [`Kind::parse`].
//! - [`Language`]: the programming languages of workers.
//! - [`layout`]: the memory image of plain types.
//! - [`member`]: members of slot arrays.
//! - [`Middleware`]: the middlewares, what they can do, and their settings ([`Key`]).
//! - [`Number`]: numbers of any type, compared exactly.
//! - [`ParameterStatus`], [`ParameterChange`]: parameters of a running component.
//! - [`Pattern`]: how operations communicate.
//! - [`Primitive`]: booleans and numbers.
//! - [`qos`]: rules that override the quality of service of topics.
//! - [`Restart`]: when a component restarts.
//! - [`Role`]: the ends of a connection.
//! - [`ros`]: names of ROS 2, and rules that remap them.
//! - [`shell`]: words of a command line.
//! - [`Stamp`]: where a message has a time that programs outside copy.
//! - [`Type`]: types where they are used, over any form of names.
//! - [`WORLD_SLOTS`]: the topics by which the replicas of a world meet.
//!
//! # Example
//!
//! ```
//! use rc_vocabulary::{Middleware, duration};
//!
//! assert_eq!(duration::parse("50ms"), Some(50_000_000));
//! assert!(Middleware::from_word("carrier pigeon").is_none());
//! ```

pub mod address;
pub mod duration;
pub mod foreign;
mod key;
mod key_lookup;
mod kind;
mod language;
pub mod layout;
pub mod member;
mod middleware;
mod number;
mod parameter;
mod pattern;
mod primitive;
pub mod qos;
mod restart;
mod role;
pub mod ros;
mod scalar;
pub mod shell;
mod stamp;
mod target;
mod types;
mod value;
mod word;
mod world;

pub use key::Key;
pub use key_lookup::{key, keys, unknown_key_help};
pub use kind::{Kind, ValueError};
pub use language::{Builder, Language, Needs};
pub use layout::Layout;
pub use middleware::{Capabilities, Middleware, Middlewares};
pub use number::Number;
pub use parameter::{ParameterChange, ParameterStatus, overlap};
pub use pattern::Pattern;
pub use primitive::{Class, Primitive};
pub use restart::{Restart, RestartPolicy};
pub use role::Role;
pub use scalar::Scalar;
pub use stamp::{Skip, Stamp, StampOf};
pub use types::Type;
pub use value::Value;
pub use word::listed;
pub use world::{WORLD_MODULE, WORLD_SLOTS, WorldSlot};
