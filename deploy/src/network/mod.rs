//! The description of a network: read, checked, and made into a plan. Nothing here starts a process.

pub(crate) mod addresses;
mod configuration;
pub mod load;
mod machine;
pub mod plan;
pub mod preview;
pub mod programs;
mod ros_names;
pub mod services;
mod unsupported;
mod variant;

pub use load::{Network, Profile, load};
