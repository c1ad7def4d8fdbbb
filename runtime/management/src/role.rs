//! The ends of a connection.

use serde::{Deserialize, Serialize};

/// The end of a connection that a component has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub enum Role {
    /// Answers calls.
    Implements,
    /// Calls.
    Requires,
    /// Sends to topics, one an operation.
    Publishes,
    /// Receives from topics, one an operation.
    SubscribesTo,
}

impl Role {
    /// The keyword of a `.cdsl`, which is also the word in JSON.
    pub fn word(self) -> &'static str {
        match self {
            Self::Implements => "implements",
            Self::Requires => "requires",
            Self::Publishes => "publishes",
            Self::SubscribesTo => "subscribesTo",
        }
    }

    /// The role of the other end.
    ///
    /// ```
    /// use rc_management::component::Role;
    ///
    /// assert_eq!(Role::Publishes.opposite(), Role::SubscribesTo);
    /// ```
    #[must_use]
    pub fn opposite(self) -> Self {
        match self {
            Self::Implements => Self::Requires,
            Self::Requires => Self::Implements,
            Self::Publishes => Self::SubscribesTo,
            Self::SubscribesTo => Self::Publishes,
        }
    }
}
