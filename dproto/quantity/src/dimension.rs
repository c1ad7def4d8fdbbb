//! The dimension of a unit: the powers of the base quantities that it is a product of.

use core::fmt;

/// The base quantities. In addition to those of the SI, angles, levels and counted things have
/// dimensions of their own: a radian is not a plain number here, and a pixel is not a bit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Base {
    /// Metres.
    Length,
    /// Kilograms.
    Mass,
    /// Seconds.
    Time,
    /// Amperes.
    Current,
    /// Kelvins.
    Temperature,
    /// Moles.
    Amount,
    /// Candelas.
    LuminousIntensity,
    /// Radians.
    Angle,
    /// Bits.
    Information,
    /// Pixels.
    Pixel,
    /// Symbols of a transmission.
    Symbol,
    /// Decibels.
    Level,
}

/// All base quantities, in the order of [`Dimension`]'s powers.
const BASES: [(Base, &str); 12] = [
    (Base::Length, "length"),
    (Base::Mass, "mass"),
    (Base::Time, "time"),
    (Base::Current, "current"),
    (Base::Temperature, "temperature"),
    (Base::Amount, "amount"),
    (Base::LuminousIntensity, "luminous intensity"),
    (Base::Angle, "angle"),
    (Base::Information, "information"),
    (Base::Pixel, "pixels"),
    (Base::Symbol, "symbols"),
    (Base::Level, "level"),
];

/// The powers of the base quantities. Prints as `length·time^-2`, and as `number` without any.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Dimension([i8; BASES.len()]);

impl Dimension {
    /// The dimension of a plain number.
    pub const NUMBER: Self = Self([0; BASES.len()]);

    /// The dimension of base quantities with their powers.
    #[must_use]
    pub(crate) const fn of(powers: &[(Base, i8)]) -> Self {
        let mut all = [0; BASES.len()];
        let mut i = 0;
        while i < powers.len() {
            all[powers[i].0 as usize] = powers[i].1;
            i += 1;
        }
        Self(all)
    }

    /// The power of a base quantity.
    #[must_use]
    pub const fn power(self, base: Base) -> i8 {
        self.0[base as usize]
    }

    /// The product with `other` to the power of `exponent`. `None` if a power does not fit.
    #[must_use]
    pub(crate) fn times(self, other: Self, exponent: i8) -> Option<Self> {
        let mut all = self.0;
        for (power, factor) in all.iter_mut().zip(other.0) {
            *power = power.checked_add(factor.checked_mul(exponent)?)?;
        }
        Some(Self(all))
    }
}

impl fmt::Display for Dimension {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut separator = "";
        for ((_, name), power) in BASES.iter().zip(self.0).filter(|(_, power)| *power != 0) {
            f.write_str(separator)?;
            f.write_str(name)?;
            if power != 1 {
                write!(f, "^{power}")?;
            }
            separator = "·";
        }
        if separator.is_empty() {
            f.write_str("number")?;
        }
        Ok(())
    }
}
