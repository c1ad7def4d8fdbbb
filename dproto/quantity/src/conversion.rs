//! A change of the unit of a number.

use crate::scale::{Scale, gcd};
use core::fmt;

/// Turns a number in one unit into a number in another one: `value × scale + offset`.
///
/// Prints as `×1/1000`, `×π/180`, or `×9/5 -45967/100`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Conversion {
    pub(crate) scale: Scale,
    pub(crate) offset: Offset,
}

/// A signed fraction in lowest terms, for units whose zero is not that of their dimension.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct Offset {
    pub(crate) numerator: i128,
    pub(crate) denominator: u128,
}

impl Offset {
    pub(crate) const ZERO: Self = Self {
        numerator: 0,
        denominator: 1,
    };

    /// `self - other`. `None` if it does not fit.
    pub(crate) fn minus(self, other: Self) -> Option<Self> {
        let cross = |a: Self, b: Self| a.numerator.checked_mul(i128::try_from(b.denominator).ok()?);
        let numerator = cross(self, other)?.checked_sub(cross(other, self)?)?;
        Some(Self::reduced(
            numerator,
            self.denominator.checked_mul(other.denominator)?,
        ))
    }

    /// The quotient with a factor that has no π. `None` if it does not fit, or has π.
    pub(crate) fn divided_by(self, scale: Scale) -> Option<Self> {
        if self.numerator == 0 {
            return Some(self);
        }
        if scale.pi() != 0 {
            return None;
        }
        let numerator = self
            .numerator
            .checked_mul(i128::try_from(scale.denominator()).ok()?)?;
        let denominator = self.denominator.checked_mul(scale.numerator())?;
        Some(Self::reduced(numerator, denominator))
    }

    fn reduced(numerator: i128, denominator: u128) -> Self {
        let divisor = gcd(numerator.unsigned_abs(), denominator).max(1);
        Self {
            // The divisor divides the numerator, so it fits unless the numerator is -2^127.
            numerator: i128::try_from(divisor).map_or(numerator, |divisor| numerator / divisor),
            denominator: denominator / divisor,
        }
    }

    #[expect(clippy::cast_precision_loss, reason = "rounded to the nearest")]
    fn as_f64(self) -> f64 {
        self.numerator as f64 / self.denominator as f64
    }
}

impl Conversion {
    /// Whether every number stays as it is.
    #[must_use]
    pub fn is_identity(&self) -> bool {
        self.scale == Scale::ONE && self.offset == Offset::ZERO
    }

    /// The factor.
    #[must_use]
    pub const fn scale(&self) -> Scale {
        self.scale
    }

    /// The number that is added after the multiplication. 0 unless a unit has a zero of its own,
    /// as degrees Celsius have.
    #[must_use]
    pub fn offset(&self) -> f64 {
        self.offset.as_f64()
    }

    /// The number in the other unit.
    #[must_use]
    pub fn apply(&self, value: f64) -> f64 {
        let value = self.scale.apply(value);
        if self.offset == Offset::ZERO {
            value
        } else {
            value + self.offset.as_f64()
        }
    }
}

impl fmt::Display for Conversion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "×{}", self.scale)?;
        if self.offset == Offset::ZERO {
            return Ok(());
        }
        write!(f, " {:+}", self.offset.numerator)?;
        if self.offset.denominator != 1 {
            write!(f, "/{}", self.offset.denominator)?;
        }
        Ok(())
    }
}
