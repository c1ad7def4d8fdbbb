//! Commands for a running network: its supervisor, its components and their logs.
//!
//! This crate starts no process. The supervisor uses its log files and errors.

pub mod by_hand;
pub mod chains;
pub mod connection;
mod digest;
pub mod error;
mod follower;
mod format;
pub mod lifecycle;
pub mod log_parts;
pub mod logs;
pub mod names;
pub mod params;
pub mod perfetto;
pub mod place;
pub mod states;
pub mod status;
mod watch;

pub use digest::digest;
pub use error::Error;
pub use follower::Follower;
pub use format::Format;
pub use watch::DirectoryWatch;
