//! What the supervisor and the components tell, as far as it is shown.

use serde::Deserialize;

/// An event, as the supervisor tells it.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
pub(crate) struct Event {
    pub(crate) time: String,
    pub(crate) component: Option<String>,
    pub(crate) message: String,
    pub(crate) severity: String,
}

/// What a component says of itself (`status` of its management).
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub(crate) struct Report {
    pub(crate) period_ms: f64,
    pub(crate) overruns: u64,
    pub(crate) compute: Work,
    pub(crate) last_error: Option<String>,
    pub(crate) slots: Vec<Slot>,
}

/// How often something was done, and how long it took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
pub(crate) struct Work {
    pub(crate) count: u64,
    pub(crate) errors: u64,
    pub(crate) p50_us: u64,
    pub(crate) p99_us: u64,
}

/// One slot of a component.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub(crate) struct Slot {
    pub(crate) name: String,
    pub(crate) role: Role,
    pub(crate) interface: String,
    pub(crate) middleware: String,
    pub(crate) address: Option<String>,
    pub(crate) peers: usize,
    pub(crate) handlers: Work,
    /// Values that were published, or calls that were made.
    #[serde(default)]
    pub(crate) sent: u64,
    pub(crate) lost: u64,
}

/// The words of the CDSL.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) enum Role {
    Implements,
    Requires,
    Publishes,
    SubscribesTo,
}

impl Role {
    pub(crate) fn word(self) -> &'static str {
        match self {
            Self::Implements => "implements",
            Self::Requires => "requires",
            Self::Publishes => "publishes",
            Self::SubscribesTo => "subscribesTo",
        }
    }

    /// What is at the other end.
    pub(crate) fn other(self) -> Self {
        match self {
            Self::Implements => Self::Requires,
            Self::Requires => Self::Implements,
            Self::Publishes => Self::SubscribesTo,
            Self::SubscribesTo => Self::Publishes,
        }
    }
}
