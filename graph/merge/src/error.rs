//! Why a change or a delta is refused.

use property_graph::Id;

/// Why a change or a delta is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Error {
    /// The end of an edge was removed.
    #[error("the end {:#x} of the edge was removed", .0.0)]
    EndRemoved(Id),
    /// Another replica has changed something with the writer of this one.
    #[error(
        "the delta has changes of writer {0} that this replica has not made: give each replica a \
         writer of its own; a restarted one merges a delta since an empty vector before it changes \
         anything"
    )]
    SameWriter(u64),
    /// A number of a writer is so far ahead that no replica can have made it.
    #[error("the delta is damaged: a number of writer {0} is too far ahead")]
    TooFar(u64),
    /// A stamp has a count or a sequence of 0.
    #[error("the delta is damaged: a change of writer {0} has no number")]
    NoNumber(u64),
    /// A name of a type or an attribute is empty, too long, or has control characters.
    #[error(
        "a name in a change of writer {0} is empty, longer than {most} bytes, or has control characters",
        most = crate::limits::MOST_NAME
    )]
    Name(u64),
    /// A value is one that no graph holds, or that no message carries.
    #[error(
        "a value in a change of writer {0} is not finite, too long, or a text with a zero byte"
    )]
    Value(u64),
    /// The delta has more elements than the replica keeps.
    #[error("a replica keeps at most {0} elements")]
    TooManyElements(usize),
    /// The delta has more attributes of one element than the replica keeps.
    #[error("an element has at most {0} attributes")]
    TooManyAttributes(usize),
    /// The delta has more writers than the replica knows.
    #[error("a replica knows at most {0} writers: give a restarted process the writer that it had")]
    TooManyWriters(usize),
    /// The replica has no number left for a change.
    #[error("no numbers are left for changes")]
    Exhausted,
}
