//! What components print, and what happens to them.

pub(crate) mod journal;
pub(crate) mod relay;
pub mod reporter;
pub(crate) mod rotation;
