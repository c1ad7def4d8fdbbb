//! What components print, and what happens to them.

pub(crate) mod follower;
pub(crate) mod journal;
pub mod logs;
pub(crate) mod relay;
pub mod reporter;
pub(crate) mod rotation;
