//! A change of the unit of a number.

use crate::factor::Factor;
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
        self.factor().apply(value)
    }

    /// The conversion as numbers of the machine.
    #[must_use]
    pub fn factor(&self) -> Factor {
        let (numerator, denominator) = self.scale.as_f64();
        Factor {
            numerator,
            denominator,
            pi: self.scale.pi(),
            offset: (self.offset != Offset::ZERO).then(|| self.offset.as_f64()),
        }
    }

    /// The integer in the other unit, rounded to the nearest one, halves away from zero. `None` if
    /// it does not fit. It is exact except for conversions with π.
    #[must_use]
    pub fn apply_integer(&self, value: i128) -> Option<i128> {
        if self.scale.pi() != 0 {
            #[expect(clippy::cast_precision_loss, reason = "rounded to the nearest")]
            let converted = self.apply(value as f64);
            return nearest(converted);
        }
        let signed = |number: u128| i128::try_from(number).ok();
        let (numerator, denominator) = (
            signed(self.scale.numerator())?,
            signed(self.scale.denominator())?,
        );
        let below = signed(self.offset.denominator)?;
        // (value × n / d) + (o / e) = (value × n × e + o × d) / (d × e)
        let scaled = value.checked_mul(numerator)?.checked_mul(below)?;
        let added = self.offset.numerator.checked_mul(denominator)?;
        let dividend = scaled.checked_add(added)?;
        let divisor = denominator.checked_mul(below)?;
        let (quotient, rest) = (dividend.checked_div(divisor)?, dividend % divisor);
        let is_up = rest.unsigned_abs() >= divisor.unsigned_abs() - rest.unsigned_abs();
        quotient.checked_add(if is_up { dividend.signum() } else { 0 })
    }

    /// The conversion as a text of ASCII that [`Conversion::from_code`] reads: `1/1000`, `1/180p1`
    /// for π/180, `9/5-45967/100`.
    #[must_use]
    pub fn code(&self) -> impl fmt::Display + use<> {
        Code(*self)
    }

    /// Reads the text of [`Conversion::code`]. `None` for any other text.
    #[must_use]
    pub fn from_code(text: &str) -> Option<Self> {
        if !text.is_ascii() {
            return None;
        }
        let sign = text[1.min(text.len())..].find(['+', '-']).map(|at| at + 1);
        let is_power = |at: usize| text[..at].ends_with('p');
        let sign = match sign {
            Some(at) if is_power(at) => text[at + 1..].find(['+', '-']).map(|next| at + 1 + next),
            sign => sign,
        };
        let (scale, offset) = text.split_at(sign.unwrap_or(text.len()));
        let (fraction, pi) = scale.split_once('p').unwrap_or((scale, "0"));
        let (numerator, denominator) = fraction.split_once('/').unwrap_or((fraction, "1"));
        let scale = Scale::reduced(
            numerator.parse().ok()?,
            denominator.parse().ok()?,
            pi.parse().ok()?,
        )?;
        let (above, below) = offset.split_once('/').unwrap_or((offset, "1"));
        let above: i128 = if above.is_empty() {
            0
        } else {
            above.parse().ok()?
        };
        let below: u128 = below.parse().ok().filter(|below| *below > 0)?;
        Some(Self {
            scale,
            offset: Offset::reduced(above, below),
        })
    }
}

/// The integer nearest to a number, if it fits.
fn nearest(value: f64) -> Option<i128> {
    // Beyond, each f64 is an integer.
    const WHOLE: f64 = 9_007_199_254_740_992.0;
    if !(-1e38..=1e38).contains(&value) {
        return None;
    }
    #[expect(clippy::cast_possible_truncation, reason = "the range is checked")]
    let whole = value as i128;
    if value.abs() >= WHOLE {
        return Some(whole);
    }
    #[expect(clippy::cast_precision_loss, reason = "exact below 2^53")]
    let rest = value - whole as f64;
    let up = if rest >= 0.5 {
        1
    } else if rest <= -0.5 {
        -1
    } else {
        0
    };
    Some(whole + up)
}

struct Code(Conversion);

impl fmt::Display for Code {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Conversion { scale, offset } = self.0;
        write!(f, "{}", scale.numerator())?;
        if scale.denominator() != 1 {
            write!(f, "/{}", scale.denominator())?;
        }
        if scale.pi() != 0 {
            write!(f, "p{}", scale.pi())?;
        }
        if offset == Offset::ZERO {
            return Ok(());
        }
        write!(f, "{:+}", offset.numerator)?;
        if offset.denominator != 1 {
            write!(f, "/{}", offset.denominator)?;
        }
        Ok(())
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
