//! A unit of measurement.

use crate::conversion::{Conversion, Offset};
use crate::dimension::Dimension;
use crate::scale::Scale;

/// A unit of measurement. Two units are equal if their numbers mean the same: `m/s` is `m*s^-1`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Unit {
    pub(crate) dimension: Dimension,
    /// One of this unit in the base units of its dimension.
    pub(crate) scale: Scale,
    /// The zero of this unit in the base units of its dimension.
    pub(crate) zero: Offset,
}

impl Unit {
    /// The unit of a plain number.
    pub const ONE: Self = Self {
        dimension: Dimension::NUMBER,
        scale: Scale::ONE,
        zero: Offset::ZERO,
    };

    /// The dimension.
    #[must_use]
    pub const fn dimension(&self) -> Dimension {
        self.dimension
    }

    /// The conversion of numbers in this unit to numbers in `other`. `None` if the dimensions
    /// differ, or if the factor has more digits than [`Scale`] holds.
    #[must_use]
    pub fn conversion_to(&self, other: &Self) -> Option<Conversion> {
        if self.dimension != other.dimension {
            return None;
        }
        Some(Conversion {
            scale: self.scale.times(other.scale.inverse()?)?,
            offset: self.zero.minus(other.zero)?.divided_by(other.scale)?,
        })
    }

    /// The product with `other` to the power of `exponent`. In products, degrees Celsius and
    /// Fahrenheit are differences, without their zeros. `None` if it does not fit.
    pub(crate) fn times(self, other: Self, exponent: i8) -> Option<Self> {
        Some(Self {
            dimension: self.dimension.times(other.dimension, exponent)?,
            scale: self.scale.times(other.scale.to_the(exponent)?)?,
            zero: Offset::ZERO,
        })
    }
}
