//! The members of slot arrays.

use rc_middleware::OpenError;
use rc_vocabulary::member::MOST;
use std::sync::Arc;

/// A member of a slot array. Its clones are the same member; they are cheap.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Member {
    index: usize,
    slot: usize,
    name: Arc<str>,
}

impl Member {
    pub(crate) fn new(index: usize, slot: usize, name: &str) -> Self {
        Self {
            index,
            slot,
            name: Arc::from(name),
        }
    }

    /// Number in the array, in the order in which the worker opened the members, from 0: an
    /// index into a list that the worker keeps.
    pub fn index(&self) -> usize {
        self.index
    }

    /// Name, as the worker opened it: `front`.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Number among all slots of the component: those of the description come first.
    pub fn slot(&self) -> usize {
        self.slot
    }
}

/// A member was not opened.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MemberError {
    /// A middleware would not take the name.
    #[error("`{name}` cannot be a member of `{array}`: {reason}")]
    BadName {
        /// The slot array.
        array: String,
        /// The name that was given.
        name: String,
        /// Rule that the name breaks.
        reason: String,
    },
    /// The array has such a member, perhaps in other letters: `Front` and `front`.
    #[error("`{array}` already has the member `{first}`; give `{name}` another name")]
    Taken {
        /// The slot array.
        array: String,
        /// The name that was given.
        name: String,
        /// The name of the member that is there.
        first: String,
    },
    /// The array has as many members as it can have.
    #[error("`{array}` has {MOST} members, which is the maximum; there is no place for `{name}`")]
    TooMany {
        /// The slot array.
        array: String,
        /// The name that was given.
        name: String,
    },
    /// The component runs: its members are known to its peers and to its tools.
    #[error("`{array}.{name}` comes too late; open members in `initialize`")]
    TooLate {
        /// The slot array.
        array: String,
        /// The name that was given.
        name: String,
    },
    /// The connection could not be opened.
    #[error(transparent)]
    Open(#[from] OpenError),
}
