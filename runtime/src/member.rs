//! Why a member of a slot array was not opened.

use rc_middleware::OpenError;
use rc_vocabulary::member::MOST;

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
