//! Quality of service, with its defaults.

use std::time::Duration;

/// Whether a publisher keeps samples that a subscriber has not received yet.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Reliability {
    /// Newer samples replace older ones.
    BestEffort,
    /// Samples arrive, within the depth.
    Reliable,
}

/// Whether late subscribers get earlier samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Durability {
    /// They get none.
    Volatile,
    /// They get the last samples, up to the depth.
    TransientLocal,
}

/// The quality of service that an endpoint offers or requests.
///
/// ```
/// use rc_middleware::{Durability, Qos};
///
/// // A map that late subscribers receive as well.
/// let map = Qos {
///     durability: Durability::TransientLocal,
///     depth: 1,
///     ..Qos::PUBLISHER
/// };
/// assert_eq!(map.reliability, Qos::PUBLISHER.reliability);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Qos {
    /// Whether unread samples are kept or replaced.
    pub reliability: Reliability,
    /// Samples for subscribers that join late.
    pub durability: Durability,
    /// Number of samples that are kept.
    pub depth: u32,
    /// Longest time between two samples; `None` for no limit.
    pub deadline: Option<Duration>,
    /// Time after which a sample expires; `None` for never.
    pub lifespan: Option<Duration>,
    /// Silence after which a publisher counts as dead; `None` for no limit.
    pub liveliness: Option<Duration>,
    /// Longest time of a call.
    pub timeout: Duration,
    /// How long a thread polls before it sleeps: a client until its reply arrives, a server or a
    /// subscriber until the next message. Zero: it does not poll.
    pub spin: Duration,
}

impl Qos {
    /// The default of a publisher: reliable, volatile, keep last 10.
    pub const PUBLISHER: Self = Self {
        reliability: Reliability::Reliable,
        durability: Durability::Volatile,
        depth: 10,
        deadline: None,
        lifespan: None,
        liveliness: None,
        timeout: Duration::from_secs(1),
        spin: Duration::ZERO,
    };
    /// The default of a subscriber: best effort, volatile, keep last 10.
    pub const SUBSCRIBER: Self = Self {
        reliability: Reliability::BestEffort,
        ..Self::PUBLISHER
    };
    /// The default of calls: reliable, one second.
    pub const CALL: Self = Self::PUBLISHER;
}

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
