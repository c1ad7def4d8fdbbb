//! The losses of a conversion.

use std::fmt;

/// The amount of a loss.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bound {
    /// At most this part of the value.
    Relative(f64),
    /// At most this, in the unit of the value.
    Absolute(f64),
    /// Unknown.
    None,
}

/// Something that a plan loses.
#[derive(Clone, Debug, PartialEq)]
pub struct Loss {
    /// The kind of a loss.
    pub what: String,
    /// How much.
    pub bound: Bound,
}

impl Loss {
    pub(crate) fn new(what: impl Into<String>, bound: Bound) -> Self {
        Self {
            what: what.into(),
            bound,
        }
    }

    /// Whether there is a bound.
    pub fn is_bounded(&self) -> bool {
        self.bound != Bound::None
    }
}

impl fmt::Display for Loss {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.bound {
            Bound::Relative(part) => write!(f, "{}, bounded: {part:.1e} of the value", self.what),
            Bound::Absolute(most) => write!(f, "{}, bounded: {most} of its unit", self.what),
            Bound::None => write!(f, "{}, not bounded", self.what),
        }
    }
}
