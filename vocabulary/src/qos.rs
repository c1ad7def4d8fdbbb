//! Quality of service: the policies with their words and limits ([`PolicyName`]), what an endpoint
//! has ([`Qos`]), what differs from the default of its role ([`Policies`]), the part by which peers
//! match ([`Contract`]), and rules that override what a `.cdsl` declares ([`Rule`]).

mod contract;
mod json;
mod policies;
mod policy;
mod rule;

pub use contract::{Contract, Difference};
pub use policies::Policies;
pub use policy::{Policy, PolicyName, PolicyValue, Values};
pub(crate) use rule::all_allowed;
pub use rule::{Rule, allowed, convert, parse, policies, unknown_topic_help};

use crate::role::Role;
use crate::word::words;
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

/// The use of a value that is older than `fresh` allows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Stale {
    /// It is used, and its age says so.
    Inform,
    /// It is not used: a handler does not run, and a call fails.
    Refuse,
    /// It replaces no value that was fresh when it came: the last one of those is used.
    Last,
}

words!(Reliability);
words!(Durability);
words!(Stale);

impl Stale {
    /// All of them, in the order in which messages list them.
    pub const ALL: [Self; 3] = [Self::Inform, Self::Refuse, Self::Last];

    /// The word for it, in files and in JSON.
    pub fn word(self) -> &'static str {
        match self {
            Self::Inform => "inform",
            Self::Refuse => "refuse",
            Self::Last => "last",
        }
    }
}

impl Reliability {
    /// All of them, in the order in which messages list them.
    pub const ALL: [Self; 2] = [Self::Reliable, Self::BestEffort];

    /// The word for it, in files and in JSON.
    pub fn word(self) -> &'static str {
        match self {
            Self::Reliable => "reliable",
            Self::BestEffort => "best_effort",
        }
    }
}

impl Durability {
    /// All of them, in the order in which messages list them.
    pub const ALL: [Self; 2] = [Self::Volatile, Self::TransientLocal];

    /// The word for it, in files and in JSON.
    pub fn word(self) -> &'static str {
        match self {
            Self::Volatile => "volatile",
            Self::TransientLocal => "transient_local",
        }
    }
}

/// The quality of service that an endpoint offers or requests.
///
/// ```
/// use rc_vocabulary::qos::{Durability, Qos};
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
    /// subscriber until the next message. Zero disables polling.
    pub spin: Duration,
    /// The age up to which a value counts as fresh; `None` if nobody asks.
    pub fresh: Option<Duration>,
    /// The use of a value that is not fresh.
    pub stale: Stale,
    /// How long the last reply answers a query; `None` for never.
    pub cache: Option<Duration>,
    /// How long the last value of the worker answers a query; `None` for never.
    pub latest: Option<Duration>,
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
        fresh: None,
        stale: Stale::Inform,
        cache: None,
        latest: None,
    };
    /// The default of a subscriber: best effort, volatile, keep last 10.
    pub const SUBSCRIBER: Self = Self {
        reliability: Reliability::BestEffort,
        ..Self::PUBLISHER
    };
    /// The default of calls: reliable, one second.
    pub const CALL: Self = Self::PUBLISHER;

    /// The default of a role.
    pub fn of(role: Role) -> Self {
        match role {
            Role::Implements | Role::Requires => Self::CALL,
            Role::Publishes => Self::PUBLISHER,
            Role::SubscribesTo => Self::SUBSCRIBER,
        }
    }

    /// Sets one policy.
    pub fn set(&mut self, policy: Policy) {
        match policy {
            Policy::Reliability(value) => self.reliability = value,
            Policy::Durability(value) => self.durability = value,
            Policy::Depth(depth) => self.depth = depth,
            Policy::Deadline(limit) => self.deadline = limit,
            Policy::Lifespan(limit) => self.lifespan = limit,
            Policy::Liveliness(limit) => self.liveliness = limit,
            Policy::Timeout(time) => self.timeout = time,
            Policy::Spin(time) => self.spin = time,
            Policy::Fresh(limit) => self.fresh = limit,
            Policy::Stale(value) => self.stale = value,
            Policy::Cache(limit) => self.cache = limit,
            Policy::Latest(limit) => self.latest = limit,
        }
    }

    /// The value of one policy.
    pub fn get(&self, name: PolicyName) -> Policy {
        match name {
            PolicyName::Reliability => Policy::Reliability(self.reliability),
            PolicyName::Durability => Policy::Durability(self.durability),
            PolicyName::Depth => Policy::Depth(self.depth),
            PolicyName::Deadline => Policy::Deadline(self.deadline),
            PolicyName::Lifespan => Policy::Lifespan(self.lifespan),
            PolicyName::Liveliness => Policy::Liveliness(self.liveliness),
            PolicyName::Timeout => Policy::Timeout(self.timeout),
            PolicyName::Spin => Policy::Spin(self.spin),
            PolicyName::Fresh => Policy::Fresh(self.fresh),
            PolicyName::Stale => Policy::Stale(self.stale),
            PolicyName::Cache => Policy::Cache(self.cache),
            PolicyName::Latest => Policy::Latest(self.latest),
        }
    }
}
