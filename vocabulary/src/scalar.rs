//! Scalars, as files and languages represent them.

/// One value as a file or a language represents it, before a [`Kind`](crate::Kind) converts it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Scalar<'a> {
    /// A whole number. Where a duration is expected, it counts milliseconds.
    Int(i64),
    /// `true` or `false`.
    Bool(bool),
    /// A duration in nanoseconds.
    Duration(u64),
    /// A text.
    Text(&'a str),
    /// Anything else, which no setting takes.
    Other,
}
