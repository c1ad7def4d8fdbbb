//! Errors between a worker and its runtime.

use rc_runtime::MemberError;

/// Why a context did nothing.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum HostError {
    /// The context was used on another thread, or while no function of the worker runs.
    #[error("the context works on the thread of the worker only, while one of its functions runs")]
    WrongThread,
    /// The generated package does not fit its description.
    #[error("slot {slot} has no such {what}; generate the component again")]
    NoSuch {
        /// `operation`, `client` …
        what: &'static str,
        /// Number of the slot.
        slot: usize,
    },
    /// A member of a slot array was not opened.
    #[error(transparent)]
    Member(#[from] MemberError),
}

impl HostError {
    pub(crate) fn no_such(what: &'static str, slot: usize) -> Self {
        Self::NoSuch { what, slot }
    }
}
