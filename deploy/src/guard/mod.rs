//! What holds a network on one machine: its lock, the registry of its processes, and the guard, a second process that
//! cleans up when the supervisor has been killed.

pub(crate) mod custody;
pub mod guard_process;
pub(crate) mod lock;
pub mod process_registry;
pub mod services;
