//! The objects that hold a network on one machine: its lock, the registry of its processes, and the
//! guard process, which cleans up if the supervisor is killed.

pub(crate) mod guard_link;
pub mod guard_process;
pub(crate) mod lock;
pub(crate) mod network_guard;
pub mod process_registry;
pub mod services;
