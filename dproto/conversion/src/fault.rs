//! Why a message cannot be converted.

use core::fmt;

/// Why a message cannot be converted. Its bytes may be partly converted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// The bytes end too early: here.
    Truncated(usize),
    /// The number at this byte does not fit its type in the other unit.
    Overflow(usize),
    /// The numbers from this byte on are none of their meaning, such as a quaternion of length 0.
    Value(usize),
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Truncated(at) => write!(f, "the message ends too early, at byte {at}"),
            Self::Overflow(at) => write!(
                f,
                "the number at byte {at} does not fit its type in the unit of the receiver"
            ),
            Self::Value(at) => write!(f, "the value at byte {at} cannot be converted"),
        }
    }
}

impl core::error::Error for Fault {}
