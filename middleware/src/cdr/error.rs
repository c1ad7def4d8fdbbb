//! The reasons why a value cannot be encoded, and why bytes are not a value.

/// A value cannot be encoded.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum EncodeError {
    /// A sequence or a string is longer than its type allows.
    #[error("`{what}` has {length} elements, its type allows {bound}")]
    TooLong {
        /// The name of the member.
        what: &'static str,
        /// Number of elements.
        length: usize,
        /// The bound of its type.
        bound: usize,
    },
    /// A number is outside the range of its annotation.
    #[error("`{what}` is {value}, outside its range {range}")]
    OutOfRange {
        /// The member.
        what: &'static str,
        /// Rejected value.
        value: f64,
        /// The range of its annotation.
        range: &'static str,
    },
    /// An integer of 64 bits is outside the range of its annotation.
    #[error("`{what}` is {value}, outside its range {range}")]
    IntegerOutOfRange {
        /// The member.
        what: &'static str,
        /// Rejected value.
        value: i128,
        /// The range of its annotation.
        range: &'static str,
    },
    /// A string holds a zero byte, which CDR does not allow.
    #[error("a string holds a zero byte")]
    ZeroByte,
    /// An enum, a `bool` or a string in place holds no valid value.
    #[error("{0}")]
    NoValue(String),
    /// There is no memory for the value.
    #[error("there is no memory for {0} bytes")]
    NoMemory(usize),
    /// A closure that serializes a value twice did not write the same bytes both times.
    #[error("the value changed while it was written")]
    Changed,
}

/// Bytes are not a value of the expected type.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DecodeError {
    /// The bytes end too early.
    #[error("the message ends too early, at byte {0}")]
    Truncated(usize),
    /// A bool or an enum holds no valid value.
    #[error("{value} is not a value of `{what}`")]
    NoSuchValue {
        /// The name of the type.
        what: &'static str,
        /// The number that was found.
        value: i64,
    },
    /// The values would take far more memory than the message.
    #[error("the values in these {0} bytes take more than four times as much memory, and 16 MiB")]
    Inflated(usize),
    /// A string is not UTF-8 or lacks its end.
    #[error("a string is not UTF-8 with a zero at its end")]
    BadString,
    /// Longer than its type allows.
    #[error("`{what}` has {length} elements, its type allows {bound}")]
    TooLong {
        /// The member.
        what: &'static str,
        /// The length found.
        length: usize,
        /// The bound of its type.
        bound: usize,
    },
    /// Outside the range of its annotation.
    #[error("`{what}` is {value}, outside its range {range}")]
    OutOfRange {
        /// The member.
        what: &'static str,
        /// The value found.
        value: f64,
        /// The range of its annotation.
        range: &'static str,
    },
    /// An integer of 64 bits is outside the range of its annotation.
    #[error("`{what}` is {value}, outside its range {range}")]
    IntegerOutOfRange {
        /// The member.
        what: &'static str,
        /// The value found.
        value: i128,
        /// The range of its annotation.
        range: &'static str,
    },
    /// The interface does not have an operation or an exception.
    #[error("unknown {0}")]
    Unknown(&'static str),
    /// A memory image does not have the size of its type.
    #[error("{length} bytes are no `{what}` in place, which has {expected}")]
    NotAnImage {
        /// The type.
        what: &'static str,
        /// The number of bytes that arrived.
        length: usize,
        /// The size of the type.
        expected: usize,
    },
    /// A memory image arrived for an operation that has none on this side.
    #[error(
        "a memory image arrived for an operation that has none here; regenerate both components"
    )]
    Image,
    /// A value cannot be copied.
    #[error(transparent)]
    Invalid(#[from] EncodeError),
}
