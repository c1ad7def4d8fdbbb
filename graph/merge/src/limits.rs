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
const GREATEST: u64 = 1 << 62;
/// The greatest number of an answer, which has the changes of a whole life. Messages of changes never
/// come near it.
const GREATEST_IN_ANSWER: u64 = 1 << 63;
/// How far a number beyond [`GREATEST`] may be ahead.
const MOST_AHEAD_THERE: u64 = 1 << 24;

/// Whether a number of a change is too far ahead of the known one.
pub(crate) fn is_far(number: u64, known: u64) -> bool {
    let most = if number > GREATEST {
        MOST_AHEAD_THERE
    } else {
        MOST_AHEAD
    };
    number.saturating_sub(known) > most
}

/// Whether a number of an answer is too far ahead of the known one. Others may have come to it by many
/// changes.
pub(crate) fn is_far_in_answer(number: u64, known: u64) -> bool {
    number > GREATEST_IN_ANSWER && is_far(number, known)
}
