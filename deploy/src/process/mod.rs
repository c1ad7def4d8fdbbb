//! The processes of this machine: identity, start, signals, end.

pub mod background;
pub(crate) mod descriptors;
pub mod identity;
pub(crate) mod launch;
pub mod machine;
pub(crate) mod memory;
pub(crate) mod orphans;
pub(crate) mod own_program;
pub(crate) mod realtime;
pub(crate) mod signals;
mod sweep;
pub(crate) mod tag;

pub use identity::Identity;
