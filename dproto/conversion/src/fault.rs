//! Why a message cannot be converted.

use core::fmt;

/// Why a message cannot be converted. Its bytes may be partly converted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// The bytes end too early: here.
    Truncated(usize),
    /// The number at this byte does not fit its type in the other unit.
    Overflow(usize),
    /// The text or the time at this byte means nothing.
    Value(usize),
    /// The numbers from this byte on are none of their meaning, such as a quaternion of length 0.
    Outside(usize, Outside),
}

/// A number that a meaning requires, such as the length of a quaternion, beside its range. It has
/// the bits of the numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Outside {
    found: u64,
    least: u64,
    most: u64,
}

impl Outside {
    pub(crate) const fn new([found, least, most]: [f64; 3]) -> Self {
        Self {
            found: found.to_bits(),
            least: least.to_bits(),
            most: most.to_bits(),
        }
    }
}

impl fmt::Display for Outside {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [found, least, most] = [self.found, self.least, self.most].map(f64::from_bits);
        if most >= f64::MAX || (least, most) == (0.0, 0.0) {
            // Only covariances require a number without an upper limit, and nothing between a constant
            // and another number.
            f.write_str("its covariance is not symmetric or not positive")
        } else if least > 0.0 && least < 1.0 && most > 1.0 {
            // A quaternion, an axis or a matrix that is no rotation.
            write!(
                f,
                "its length is {found}, and must be from {least} to {most}"
            )
        } else {
            // A number of another type, or the last row of a matrix.
            write!(f, "{found} is not from {least} to {most}")
        }
    }
}

impl Fault {
    /// The byte of the message.
    #[must_use]
    pub const fn at(&self) -> usize {
        match self {
            Self::Truncated(at) | Self::Overflow(at) | Self::Value(at) | Self::Outside(at, _) => {
                *at
            }
        }
    }

    /// This fault at another byte.
    #[must_use]
    pub const fn moved(self, to: usize) -> Self {
        match self {
            Self::Truncated(_) => Self::Truncated(to),
            Self::Overflow(_) => Self::Overflow(to),
            Self::Value(_) => Self::Value(to),
            Self::Outside(_, outside) => Self::Outside(to, outside),
        }
    }
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
            Self::Outside(at, outside) => {
                write!(f, "the value at byte {at} cannot be converted: {outside}")
            }
        }
    }
}

impl core::error::Error for Fault {}
