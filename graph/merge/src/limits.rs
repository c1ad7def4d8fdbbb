//! Limits of a replica and of a delta.

/// How long a name of a type or of an attribute is at most, in bytes.
pub(crate) const MOST_NAME: usize = 256;
/// The longest text or array of a value, in bytes.
pub(crate) const MOST_VALUE: usize = 1 << 24;
/// How many elements a replica keeps at most, with removed ones and those that are not known yet.
pub const MOST_ELEMENTS: usize = 1 << 22;
/// How many attributes an element has at most.
pub(crate) const MOST_ATTRIBUTES: usize = 1 << 12;
/// How many writers a replica knows at most.
pub(crate) const MOST_WRITERS: usize = 1 << 14;
/// How far a number in a delta may be ahead of the replica's numbers. At a change each microsecond,
/// a replica is ahead by this after nine years.
pub(crate) const MOST_AHEAD: u64 = 1 << 48;
/// Numbers that replicas count themselves never come near this limit. Beyond it, a number may be
/// ahead by less, so that enough numbers are left after any messages.
pub(crate) const GREATEST: u64 = 1 << 62;
/// How far a number beyond [`GREATEST`] may be ahead.
pub(crate) const MOST_AHEAD_THERE: u64 = 1 << 24;
