//! Settings of middlewares: which keys a middleware has, what values they take, and how text
//! becomes a value.
//!
//! Configurations, `.ddsl` files and command lines share the table [`MIDDLEWARES`]. Each of them
//! converts what is written into a [`Value`] once, by [`Kind::convert`] or [`Kind::parse`]; from
//! there on settings are values.
//!
//! - [`address`]: addresses of slots.
//! - [`duration`]: durations as people write them.
//! - [`member`]: members of slot arrays.
//! - [`qos`]: rules that override the quality of service of topics.
//! - [`ros`]: names of ROS 2, and rules that remap them.

pub mod address;
pub mod duration;
mod key;
mod kind;
pub mod member;
pub mod qos;
pub mod ros;
mod scalar;
mod target;
mod value;

pub use key::{Key, MIDDLEWARES, key, keys, unknown_key_help};
pub use kind::{Kind, ValueError};
pub use scalar::Scalar;
pub use value::Value;
