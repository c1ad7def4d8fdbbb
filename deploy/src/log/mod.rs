//! Logs: output of components, and events of the network.

pub(crate) mod journal;
pub(crate) mod relay;
pub mod reporter;
pub(crate) mod rotation;
