//! Exact factors: fractions, with a power of π for angles.

use core::fmt;

/// A positive factor: `numerator / denominator × π^pi`, in lowest terms.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Scale {
    numerator: u128,
    denominator: u128,
    pi: i8,
}

impl Scale {
    /// The factor 1.
    pub const ONE: Self = Self::ratio(1, 1);

    /// The factor `numerator / denominator`, both positive and without a common divisor.
    pub(crate) const fn ratio(numerator: u128, denominator: u128) -> Self {
        Self {
            numerator,
            denominator,
            pi: 0,
        }
    }

    /// The factor `numerator / denominator × π`, with numbers as those of [`Scale::ratio`].
    pub(crate) const fn ratio_of_pi(numerator: u128, denominator: u128) -> Self {
        Self {
            numerator,
            denominator,
            pi: 1,
        }
    }

    /// The numerator of the fraction.
    #[must_use]
    pub const fn numerator(self) -> u128 {
        self.numerator
    }

    /// The denominator of the fraction.
    #[must_use]
    pub const fn denominator(self) -> u128 {
        self.denominator
    }

    /// The power of π.
    #[must_use]
    pub const fn pi(self) -> i8 {
        self.pi
    }

    /// The reciprocal. `None` if the power of π does not fit.
    pub(crate) fn inverse(self) -> Option<Self> {
        Some(Self {
            numerator: self.denominator,
            denominator: self.numerator,
            pi: self.pi.checked_neg()?,
        })
    }

    /// The product. `None` if it does not fit.
    pub(crate) fn times(self, other: Self) -> Option<Self> {
        // Reduced crosswise first, so that only the result must fit.
        let left = gcd(self.numerator, other.denominator);
        let right = gcd(other.numerator, self.denominator);
        Some(Self {
            numerator: (self.numerator / left).checked_mul(other.numerator / right)?,
            denominator: (self.denominator / right).checked_mul(other.denominator / left)?,
            pi: self.pi.checked_add(other.pi)?,
        })
    }

    /// The factor to a power. `None` if it does not fit.
    pub(crate) fn to_the(self, exponent: i8) -> Option<Self> {
        let base = if exponent < 0 { self.inverse()? } else { self };
        (0..exponent.unsigned_abs()).try_fold(Self::ONE, |all, _| all.times(base))
    }

    /// The factor with these parts. `None` if a part of the fraction is 0.
    pub(crate) fn reduced(numerator: u128, denominator: u128, pi: i8) -> Option<Self> {
        let divisor = gcd(numerator, denominator);
        (numerator > 0 && denominator > 0).then(|| Self {
            numerator: numerator / divisor,
            denominator: denominator / divisor,
            pi,
        })
    }

    /// Numerator and denominator.
    #[expect(clippy::cast_precision_loss, reason = "rounded to the nearest")]
    pub(crate) fn as_f64(self) -> (f64, f64) {
        (self.numerator as f64, self.denominator as f64)
    }
}

impl fmt::Display for Scale {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.numerator != 1 || self.pi <= 0 {
            write!(f, "{}", self.numerator)?;
        }
        match self.pi {
            0 => {}
            1 => f.write_str("π")?,
            pi if pi > 0 => write!(f, "π^{pi}")?,
            _ => {}
        }
        match (self.denominator, self.pi) {
            (1, 0..) => Ok(()),
            (denominator, 0..) => write!(f, "/{denominator}"),
            (1, -1) => f.write_str("/π"),
            (1, pi) => write!(f, "/π^{}", pi.unsigned_abs()),
            (denominator, -1) => write!(f, "/({denominator}π)"),
            (denominator, pi) => write!(f, "/({denominator}π^{})", pi.unsigned_abs()),
        }
    }
}

pub(crate) const fn gcd(mut a: u128, mut b: u128) -> u128 {
    while b != 0 {
        (a, b) = (b, a % b);
    }
    a
}
