//! Quality of service, and how many endpoints may meet.

pub use rc_vocabulary::qos::{
    Contract, Difference, Durability, Policies, Policy, Qos, Reliability,
};

/// Most subscribers of a topic and most clients of a server.
pub const MAX_READERS: usize = 64;
/// Most tools that observe a topic. They have places of their own.
pub const MAX_OBSERVERS: usize = 4;
/// Most publishers of a topic.
pub const MAX_PUBLISHERS: usize = 16;
/// Most processes of one service.
pub const MAX_NODES: usize = 128;
/// Most requests of one client that wait at a server.
pub const REQUEST_QUEUE: usize = 16;
