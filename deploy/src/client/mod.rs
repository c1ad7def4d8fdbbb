//! What the other commands ask of a network that is up, and of its components.

pub mod connection;
pub(crate) mod names;
pub mod params;
pub mod status;
