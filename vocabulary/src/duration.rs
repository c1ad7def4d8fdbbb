//! Durations as people write them: `50ms`, `1.5 s`, `2min`, `1h`, `10us`.
//!
//! This module is the only place where text becomes a duration, in descriptions, configurations
//! and command lines. Durations are counts of nanoseconds. Parsing is exact: no step goes through
//! a floating-point number.

use std::time::Duration;

/// The longest duration that a setting takes. A longer one is most likely a mistake.
pub(crate) const LONGEST: Duration = Duration::from_hours(24);

/// The units, each with its length in nanoseconds.
const UNITS: [(&str, u64); 5] = [
    ("us", 1_000),
    ("ms", 1_000_000),
    ("s", 1_000_000_000),
    ("min", 60_000_000_000),
    ("h", 3_600_000_000_000),
];

/// Parses a number with a unit (`us`, `ms`, `s`, `min` or `h`) into nanoseconds.
///
/// The number may have a fraction and an exponent. A fraction of a nanosecond is rounded to the
/// nearest one. A duration beyond `u64::MAX` nanoseconds gives `u64::MAX`.
///
/// ```
/// use rc_vocabulary::duration;
///
/// assert_eq!(duration::parse("1.5 ms"), Some(1_500_000));
/// assert_eq!(duration::parse("50"), None);
/// ```
pub fn parse(text: &str) -> Option<u64> {
    let (number, word) = split(text)?;
    let mut units = UNITS.iter();
    let (_, unit) = units.find(|(name, _)| *name == word)?;
    Some(Decimal::parse(number)?.times(*unit))
}

/// A number and the word after it. An `e` belongs to the number.
fn split(text: &str) -> Option<(&str, &str)> {
    let begins_word = |c: char| c.is_alphabetic() && c != 'e' && c != 'E';
    let (number, word) = text.split_at(text.find(begins_word)?);
    Some((number.trim(), word.trim()))
}

/// Whether `word` is the unit of a duration.
pub fn is_unit(word: &str) -> bool {
    UNITS.iter().any(|(unit, _)| *unit == word)
}

/// The error about a text that is a number with an unknown unit.
///
/// ```
/// use rc_vocabulary::duration;
///
/// assert!(duration::unknown_unit("3 sec").is_some());
/// assert_eq!(duration::unknown_unit("soon"), None);
/// assert_eq!(duration::unknown_unit("1e3"), None);
/// ```
pub fn unknown_unit(text: &str) -> Option<&'static str> {
    let (number, word) = split(text)?;
    let has_number = number
        .trim_start_matches(['+', '-', '.'])
        .starts_with(|c: char| c.is_ascii_digit());
    (has_number && !is_unit(word)).then_some("unknown unit; the units are us, ms, s, min and h")
}

/// The help for a `text` that is not a valid duration: first what is wrong with its unit, then what
/// is allowed.
pub fn help(text: &str, allowed: &str) -> String {
    match unknown_unit(text) {
        Some(wrong) => format!("{wrong}; allowed is {allowed}"),
        None => format!("allowed is {allowed}"),
    }
}

/// Converts a whole number of milliseconds into nanoseconds. `None` if it is negative or too large.
pub fn from_milliseconds(milliseconds: i64) -> Option<u64> {
    let milliseconds = u64::try_from(milliseconds).ok()?;
    milliseconds.checked_mul(1_000_000)
}

/// Converts a number of milliseconds into nanoseconds, rounded to the nearest one. `None` if it
/// is negative, not a number or too large.
pub fn from_fractional_milliseconds(milliseconds: f64) -> Option<u64> {
    let nanoseconds = (milliseconds * 1e6).round();
    // The comparison is false for NaN.
    (milliseconds >= 0.0 && nanoseconds < u64::MAX as f64).then_some(nanoseconds as u64)
}

/// Prints a duration in the largest unit that needs no fraction, or in microseconds with a
/// fraction. [`parse`] reads the same number of nanoseconds from it.
///
/// ```
/// use rc_vocabulary::duration;
///
/// assert_eq!(duration::text(1_500_000_000), "1500ms");
/// assert_eq!(duration::text(100_000_001), "100000.001us");
/// ```
pub fn text(nanoseconds: u64) -> String {
    match nanoseconds {
        0 => "0ms".to_owned(),
        ns if ns % 1_000_000_000 == 0 => format!("{}s", ns / 1_000_000_000),
        ns if ns % 1_000_000 == 0 => format!("{}ms", ns / 1_000_000),
        ns if ns % 1_000 == 0 => format!("{}us", ns / 1_000),
        ns => format!("{}.{:03}us", ns / 1_000, ns % 1_000),
    }
}

/// Prints a [`Duration`] as [`text`] does.
pub fn text_of(duration: Duration) -> String {
    text(u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX))
}

/// `digits` times ten to the power of `exponent`.
struct Decimal {
    digits: u128,
    exponent: i64,
}

impl Decimal {
    /// With so many digits, a product with the longest unit fits into 128 bits. The value of
    /// further digits of a fraction is below a nanosecond.
    const LARGEST: u128 = 10_u128.pow(24);

    /// Parses digits with an optional sign, fraction and exponent.
    fn parse(text: &str) -> Option<Self> {
        let (number, exponent) = match text.split_once(['e', 'E']) {
            Some((number, exponent)) => (number, parse_exponent(exponent)?),
            None => (text, 0),
        };
        let number = number.strip_prefix('+').unwrap_or(number);
        let (whole, fraction) = number.split_once('.').unwrap_or((number, ""));
        if whole.is_empty() && fraction.is_empty() {
            return None;
        }
        let mut decimal = Self {
            digits: 0,
            exponent,
        };
        for (digit, is_fraction) in whole
            .chars()
            .map(|digit| (digit, false))
            .chain(fraction.chars().map(|digit| (digit, true)))
        {
            let digit = digit.to_digit(10)?;
            let kept = decimal.digits < Self::LARGEST;
            if kept {
                decimal.digits = decimal.digits * 10 + u128::from(digit);
            }
            match (kept, is_fraction) {
                (true, true) => decimal.exponent -= 1,
                (false, false) => decimal.exponent += 1,
                (true, false) | (false, true) => {}
            }
        }
        Some(decimal)
    }

    /// The product with `unit`, rounded to the nearest whole number, at most `u64::MAX`.
    fn times(self, unit: u64) -> u64 {
        let product = self.digits * u128::from(unit);
        let scale = u32::try_from(self.exponent.unsigned_abs()).ok();
        let scale = scale.and_then(|exponent| 10_u128.checked_pow(exponent));
        let rounded = match (scale, self.exponent < 0) {
            (_, _) if product == 0 => Some(0),
            (Some(scale), false) => product.checked_mul(scale),
            (None, false) => None,
            (Some(scale), true) => {
                Some(product / scale + u128::from(product % scale >= scale.div_ceil(2)))
            }
            (None, true) => Some(0),
        };
        rounded.map_or(u64::MAX, |value| u64::try_from(value).unwrap_or(u64::MAX))
    }
}

/// Parses an exponent. One with more digits than any duration has counts as the largest.
fn parse_exponent(text: &str) -> Option<i64> {
    const LARGEST: i64 = 1 << 32;
    let (sign, digits) = match text.strip_prefix('-') {
        Some(digits) => (-1, digits),
        None => (1, text.strip_prefix('+').unwrap_or(text)),
    };
    if digits.is_empty() || !digits.bytes().all(|digit| digit.is_ascii_digit()) {
        return None;
    }
    Some(sign * digits.parse().unwrap_or(LARGEST).min(LARGEST))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_and_durations_convert_both_ways() {
        for (written, ns) in [
            ("10us", 10_000),
            ("50ms", 50_000_000),
            ("3s", 3_000_000_000),
            ("1.500us", 1_500),
            ("100000.001us", 100_000_001),
            ("18446744073709551.614us", u64::MAX - 1),
            ("9007199254740.993us", 9_007_199_254_740_993),
        ] {
            assert_eq!(parse(written), Some(ns));
            assert_eq!(text(ns), written);
        }
    }

    #[test]
    fn numbers_have_fractions_exponents_and_spaces() {
        for (written, ns) in [
            ("2min", 120_000_000_000),
            ("1.5 h", 5_400_000_000_000),
            (" 1.5 s ", 1_500_000_000),
            ("+.5s", 500_000_000),
            ("1.ms", 1_000_000),
            ("1e3ms", 1_000_000_000),
            ("1E-3 s", 1_000_000),
            ("1.0004us", 1_000),
            ("1.0005us", 1_001),
            ("0.1e99999999999999999999us", u64::MAX),
            ("0e99999999999999999999us", 0),
            ("1e-99999999999999999999min", 0),
            ("1e400s", u64::MAX),
            ("18446744073709551.616us", u64::MAX),
            (&format!("{}h", "9".repeat(27)), u64::MAX),
            (&format!("0.{}h", "1".repeat(40)), 400_000_000_000),
            (&format!("0.{}1s", "0".repeat(200)), 0),
            (&format!("{}e-200s", "1".repeat(201)), 1_111_111_111),
        ] {
            assert_eq!(parse(written), Some(ns), "{written}");
        }
    }

    #[test]
    fn other_texts_are_no_durations() {
        for written in [
            "", "50", "-1s", "-0s", "s", ".s", "1.2.3s", "1e s", "1e+s", "1 d", "infs", "nans",
            "1ns", "0x1s", "1_0s",
        ] {
            assert_eq!(parse(written), None, "{written}");
        }
    }

    #[test]
    fn plain_numbers_count_milliseconds() {
        assert_eq!(from_milliseconds(50), Some(50_000_000));
        assert_eq!(from_milliseconds(-1), None);
        assert_eq!(from_milliseconds(i64::MAX), None);
        assert_eq!(from_fractional_milliseconds(0.1), Some(100_000));
        assert_eq!(from_fractional_milliseconds(-0.1), None);
        assert_eq!(from_fractional_milliseconds(f64::NAN), None);
        assert_eq!(from_fractional_milliseconds(1e300), None);
    }
}
