//! Numbers of any type.

use std::cmp::Ordering;
use std::fmt;

/// A number. Integers stay exact, whatever they are compared with: those of 64 bits have more
/// digits than an `f64`.
#[derive(Clone, Copy, Debug)]
pub enum Number {
    /// An integer.
    Int(i128),
    /// A floating-point number.
    Float(f64),
}

impl Number {
    /// The nearest `f64`.
    pub fn as_float(self) -> f64 {
        match self {
            Self::Int(value) => value as f64,
            Self::Float(value) => value,
        }
    }
}

impl PartialEq for Number {
    fn eq(&self, other: &Self) -> bool {
        self.partial_cmp(other) == Some(Ordering::Equal)
    }
}

impl PartialOrd for Number {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        match (self, other) {
            (Self::Int(a), Self::Int(b)) => Some(a.cmp(b)),
            (Self::Float(a), Self::Float(b)) => a.partial_cmp(b),
            (Self::Int(a), Self::Float(b)) => compare_int_with_float(*a, *b),
            (Self::Float(a), Self::Int(b)) => compare_int_with_float(*b, *a).map(Ordering::reverse),
        }
    }
}

/// Compares without rounding the integer to a float.
fn compare_int_with_float(int: i128, float: f64) -> Option<Ordering> {
    // -2^127 is an integer, 2^127 is above all of them.
    const LEAST: f64 = i128::MIN as f64;
    if !(LEAST..-LEAST).contains(&float) {
        return 0.0_f64.partial_cmp(&float);
    }
    let whole = int.cmp(&(float.trunc() as i128));
    Some(whole.then(0.0_f64.partial_cmp(&float.fract())?))
}

impl fmt::Display for Number {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Int(value) => value.fmt(f),
            Self::Float(value) => value.fmt(f),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_numbers_and_floats_are_compared_without_rounding() {
        let large = (1_i128 << 53) + 1;
        assert_eq!(
            compare_int_with_float(large, 9_007_199_254_740_992.0),
            Some(Ordering::Greater)
        );
        assert_eq!(compare_int_with_float(2, 2.5), Some(Ordering::Less));
        assert_eq!(compare_int_with_float(-2, -2.5), Some(Ordering::Greater));
        assert_eq!(compare_int_with_float(-2, -2.0), Some(Ordering::Equal));
        assert_eq!(
            compare_int_with_float(i128::MAX, 1e300),
            Some(Ordering::Less)
        );
        assert_eq!(
            compare_int_with_float(i128::MIN, -1e300),
            Some(Ordering::Greater)
        );
        assert_eq!(
            compare_int_with_float(i128::MIN, i128::MIN as f64),
            Some(Ordering::Equal)
        );
        assert_eq!(
            compare_int_with_float(0, f64::INFINITY),
            Some(Ordering::Less)
        );
        assert_eq!(
            compare_int_with_float(0, f64::NEG_INFINITY),
            Some(Ordering::Greater)
        );
        assert_eq!(compare_int_with_float(0, f64::NAN), None);
    }
}
