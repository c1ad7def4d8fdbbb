//! The ends of a connection.

use crate::word::words;

/// The end of a connection that a component has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Role {
    /// Server of calls.
    Implements,
    /// Client of calls.
    Requires,
    /// Publisher of topics, one an operation.
    Publishes,
    /// Subscriber of topics, one an operation.
    SubscribesTo,
}

words!(Role);

impl Role {
    /// All of them, in the order in which messages list them.
    pub const ALL: [Self; 4] = [
        Self::Implements,
        Self::Requires,
        Self::Publishes,
        Self::SubscribesTo,
    ];

    /// The word for it, in files and in JSON.
    pub fn word(self) -> &'static str {
        match self {
            Self::Implements => "implements",
            Self::Requires => "requires",
            Self::Publishes => "publishes",
            Self::SubscribesTo => "subscribesTo",
        }
    }

    /// The role that a word of a `.cdsl` names, in either case. The paper on RoboComp's CDSL uses
    /// `request`.
    pub fn from_file(word: &str) -> Option<Self> {
        if word.eq_ignore_ascii_case("request") {
            return Some(Self::Requires);
        }
        let mut all = Self::ALL.into_iter();
        all.find(|role| role.word().eq_ignore_ascii_case(word))
    }

    /// Whether it belongs to topics, not to calls.
    pub fn is_topic(self) -> bool {
        match self {
            Self::Publishes | Self::SubscribesTo => true,
            Self::Implements | Self::Requires => false,
        }
    }

    /// Whether others connect to it.
    pub fn is_provided(self) -> bool {
        match self {
            Self::Implements | Self::Publishes => true,
            Self::Requires | Self::SubscribesTo => false,
        }
    }

    /// The role of the other end.
    ///
    /// ```
    /// use rc_vocabulary::Role;
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
