//! Quality of service, and how many endpoints may meet.

pub use rc_vocabulary::qos::{
    Contract, Difference, Durability, Policies, Policy, Qos, Reliability, Stale,
};

/// Most subscribers of a topic and most clients of a server.
pub const MAX_READERS: usize = 64;
/// Most tools that observe a topic. They have places of their own.
pub const MAX_OBSERVERS: usize = 4;
/// Most publishers of a topic that is not deeper than that.
pub const MAX_PUBLISHERS: usize = 16;
/// Most publishers of any topic.
pub const MOST_PUBLISHERS: usize = 64;
/// Most processes of one service.
pub const MAX_NODES: usize = 128;
/// Most requests of one client that wait at a server.
pub const REQUEST_QUEUE: usize = 16;
/// Most started calls of one client that have not ended. Half the queue of requests stays free for
/// commands and for calls that wait.
pub const STARTED_CALLS: usize = REQUEST_QUEUE / 2;

/// How many publishers a topic of this depth admits: as many as its depth, so that a sample of each
/// waits at a subscriber, but at least [`MAX_PUBLISHERS`] and at most [`MOST_PUBLISHERS`].
///
/// ```
/// use rc_middleware::qos::publishers;
///
/// assert_eq!([1, 16, 40, 64, 1000].map(publishers), [16, 16, 40, 64, 64]);
/// ```
pub fn publishers(depth: usize) -> usize {
    depth.clamp(MAX_PUBLISHERS, MOST_PUBLISHERS)
}
