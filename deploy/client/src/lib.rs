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
mod log_filter;
pub mod log_parts;
pub mod logs;
pub mod names;
pub mod network_parameters;
pub mod params;
pub mod perfetto;
pub mod place;
pub mod start_report;
pub mod states;
pub mod status;
mod watch;

pub use digest::digest;
pub use error::Error;
pub use follower::Follower;
pub use format::Format;
pub use log_filter::{Level, LogFilter};
pub use watch::DirectoryWatch;
