//! A conversion as numbers of the machine, for programs that convert many values.

use crate::Real;
use core::f64::consts::PI;

/// `value × numerator / denominator × π^pi + offset`, in this order. It gives the same bits as
/// [`Conversion::apply`](crate::Conversion::apply).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Factor {
    pub(crate) numerator: f64,
    pub(crate) denominator: f64,
    pub(crate) pi: i8,
    /// `None` if nothing is added: the sum of -0 and 0 is 0.
    pub(crate) offset: Option<f64>,
}

impl Factor {
    /// The number in the other unit. NaN stays NaN.
    #[inline]
    #[must_use]
    pub fn apply<T: Real>(&self, value: T) -> T {
        let mut value = value * T::constant(self.numerator) / T::constant(self.denominator);
        for _ in 0..self.pi.unsigned_abs() {
            value = if self.pi > 0 {
                value * T::constant(PI)
            } else {
                value / T::constant(PI)
            };
        }
        match self.offset {
            Some(offset) => value + T::constant(offset),
            None => value,
        }
    }

    /// Numerator and denominator, if the conversion is `value × numerator / denominator` and nothing
    /// more.
    #[must_use]
    pub fn fraction(&self) -> Option<(f64, f64)> {
        let is_plain = self.pi == 0 && self.offset.is_none();
        is_plain.then_some((self.numerator, self.denominator))
    }

    /// Whether it multiplies and divides only: nothing is added.
    #[must_use]
    pub fn is_scale(&self) -> bool {
        self.offset.is_none()
    }

    /// The number of multiplications, divisions and additions for one value. A factor of 1 costs
    /// nothing.
    #[must_use]
    pub fn operations(&self) -> u32 {
        #[expect(clippy::float_cmp, reason = "a factor that is 1 is exactly 1")]
        let count = |factor: f64| u32::from(factor != 1.0);
        let pi = u32::from(self.pi.unsigned_abs());
        count(self.numerator) + count(self.denominator) + pi + u32::from(self.offset.is_some())
    }
}
