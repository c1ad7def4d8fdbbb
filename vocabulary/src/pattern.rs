//! How an operation communicates.

use crate::word::words;

/// A communication pattern.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Pattern {
    /// A call without a reply, or a sample of a topic.
    Command,
    /// A call with a reply.
    Query,
    /// Only a sample of a topic.
    Publish,
}

words!(Pattern);

impl Pattern {
    /// All of them, in the order in which messages list them.
    pub const ALL: [Self; 3] = [Self::Command, Self::Query, Self::Publish];

    /// The keyword of the IDSL, which descriptions have, too.
    pub fn word(self) -> &'static str {
        match self {
            Self::Command => "command",
            Self::Query => "query",
            Self::Publish => "publish",
        }
    }
}
