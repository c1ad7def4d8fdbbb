//! What a conversion loses.

use std::fmt;

/// How much is lost.
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
    /// What is lost.
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
