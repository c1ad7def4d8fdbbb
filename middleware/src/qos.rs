//! Quality of service, with the defaults in this one place.

use std::time::Duration;

/// Whether a publisher keeps what a subscriber has not read yet.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Reliability {
    /// Newer values replace older ones.
    BestEffort,
    /// What was sent arrives, within the depth.
    Reliable,
}

/// Whether late subscribers get what was sent before.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Durability {
    /// They do not.
    Volatile,
    /// They get the last values, up to the depth.
    TransientLocal,
}

/// The quality of service that one end offers or asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Qos {
    /// Kept or replaced.
    pub reliability: Reliability,
    /// For late subscribers.
    pub durability: Durability,
    /// How many values are kept.
    pub depth: u32,
    /// The longest time between two values; without, there is none.
    pub deadline: Option<Duration>,
    /// How long a value is worth anything after it was sent; without, for ever.
    pub lifespan: Option<Duration>,
    /// After how long of silence a publisher counts as dead; without, the middleware decides.
    pub liveliness: Option<Duration>,
    /// How long a call may take.
    pub timeout: Duration,
    /// How long one who waits stays awake before it sleeps: a client for its answer, a server and a subscriber after a
    /// message for the next one. Zero: not at all.
    pub spin: Duration,
}

impl Qos {
    /// What a publisher offers: reliable, volatile, keep last 10.
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
    /// What a subscriber asks for: best effort, volatile, keep last 10.
    pub const SUBSCRIBER: Self = Self {
        reliability: Reliability::BestEffort,
        ..Self::PUBLISHER
    };
    /// What calls use: reliable, one second.
    pub const CALL: Self = Self::PUBLISHER;
}

/// Most subscribers of a topic and most clients of a server.
pub const MAX_READERS: usize = 64;
/// Most publishers of a topic.
pub const MAX_PUBLISHERS: usize = 16;
/// Most processes of one service.
pub const MAX_NODES: usize = 128;
/// Requests of one client that may wait at a server.
pub const REQUEST_QUEUE: usize = 16;
