//! Numbers that rotations are computed with.

use core::ops::{Add, Div, Mul, Neg, Sub};

/// A real number: `f64`, or a term of a formula. One algorithm then computes a rotation, and prints
/// the code that computes it.
pub trait Real:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// A number that is known.
    fn constant(value: f64) -> Self;
    /// The square root.
    #[must_use]
    fn root(self) -> Self;
    /// The sine of an angle in radians.
    #[must_use]
    fn sine(self) -> Self;
    /// The cosine of an angle in radians.
    #[must_use]
    fn cosine(self) -> Self;
    /// The angle of the point with this y, from -π to π.
    #[must_use]
    fn angle_over(self, x: Self) -> Self;
    /// The length of the vector of both.
    #[must_use]
    fn length_with(self, other: Self) -> Self;
    /// `then` if this is below `limit`, else `otherwise`; also for NaN. Both are computed.
    #[must_use]
    fn if_below(self, limit: Self, then: Self, otherwise: Self) -> Self;
}

impl Real for f64 {
    #[inline]
    fn constant(value: f64) -> Self {
        value
    }

    #[inline]
    fn root(self) -> Self {
        libm::sqrt(self)
    }

    #[inline]
    fn sine(self) -> Self {
        libm::sin(self)
    }

    #[inline]
    fn cosine(self) -> Self {
        libm::cos(self)
    }

    #[inline]
    fn angle_over(self, x: Self) -> Self {
        libm::atan2(self, x)
    }

    #[inline]
    fn length_with(self, other: Self) -> Self {
        libm::hypot(self, other)
    }

    #[inline]
    fn if_below(self, limit: Self, then: Self, otherwise: Self) -> Self {
        if self < limit { then } else { otherwise }
    }
}
