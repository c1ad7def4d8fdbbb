//! Results that are one number of a group times a factor.

use crate::formula::{Formula, Operand, Operation};

/// Times the first number, over the second one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Scale(pub(super) f64, pub(super) f64);

impl Default for Scale {
    /// The number as it is.
    fn default() -> Self {
        Self(1.0, 1.0)
    }
}

impl Scale {
    /// Whether it may be computed as `float32`: a product or a quotient of two `float32` has the same
    /// bits if it is computed as `float64` and rounded, because that has more than twice as many
    /// digits.
    pub(super) fn is_single(self) -> bool {
        let Self(numerator, denominator) = self;
        #[expect(clippy::cast_possible_truncation, reason = "compared")]
        let is_single = |number: f64| f64::from(number as f32) == number;
        let rounds_once = numerator.abs() == 1.0 || denominator == 1.0;
        rounds_once && is_single(numerator) && is_single(denominator)
    }

    /// The greatest amount whose result is finite by this function. Negative if there is none.
    pub(super) fn limit(self, is_finite: fn(f64) -> bool) -> f64 {
        let holds = |bits: u64| is_finite(f64::from_bits(bits) * self.0 / self.1);
        // The bits of positive numbers have their order.
        let (mut least, mut most) = (0, f64::MAX.to_bits());
        if !holds(least) {
            return -1.0;
        }
        while least < most {
            let middle = least + (most - least).div_ceil(2);
            if holds(middle) {
                least = middle;
            } else {
                most = middle - 1;
            }
        }
        f64::from_bits(least)
    }
}

/// Whether a number is finite as a `float32`.
#[expect(clippy::cast_possible_truncation, reason = "rounded to the nearest")]
pub(super) fn is_finite_single(value: f64) -> bool {
    (value as f32).is_finite()
}

/// The greatest `float32` that is not above a number.
pub(super) fn single_below(value: f64) -> f32 {
    #[expect(clippy::cast_possible_truncation, reason = "corrected")]
    let nearest = (value as f32).min(f32::MAX);
    if f64::from(nearest) > value {
        nearest.next_down()
    } else {
        nearest
    }
}

/// The number of the group that an operand is a multiple of, with the factor, and whether it is
/// rounded to a `float32`.
pub(super) fn scaled(formula: &Formula, operand: Operand) -> Option<(usize, Scale, bool)> {
    let (mut operand, mut sign, mut is_single) = (operand, 1.0, false);
    let (mut numerator, mut denominator) = (None, None);
    // From the result to the number: the conversions of units multiply, then divide.
    loop {
        let step = match operand {
            Operand::Input(at) => {
                let numerator: f64 = numerator.unwrap_or(1.0);
                let scale = Scale(sign * numerator, denominator.unwrap_or(1.0));
                return Some((at as usize, scale, is_single));
            }
            Operand::Step(at) => formula.steps.get(at as usize)?,
            Operand::Constant(_) | Operand::Transform(_) => return None,
        };
        let constant = |at: usize| match step.operands.get(at) {
            Some(Operand::Constant(bits)) => Some(f64::from_bits(*bits)),
            _ => None,
        };
        match step.operation {
            Operation::Negate => sign = -sign,
            // Rounded before the factor, it would be another number.
            Operation::Single if numerator.is_none() && denominator.is_none() => is_single = true,
            Operation::Divide if numerator.is_none() && denominator.is_none() => {
                denominator = Some(constant(1)?);
            }
            Operation::Multiply if numerator.is_none() => numerator = Some(constant(1)?),
            _ => return None,
        }
        operand = *step.operands.first()?;
    }
}
