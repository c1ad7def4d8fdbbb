//! The texts of units.

use crate::table;
use crate::unit::Unit;
use core::fmt;
use core::ops::Range;

/// The greatest length of the text of a unit, in bytes.
pub const MAX_LENGTH: usize = 64;
/// The greatest power in a text.
const MAX_POWER: i8 = 9;

/// Why a text is not a unit.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnitError {
    /// The bytes of the text that are wrong. Empty at the end of the text.
    pub range: Range<usize>,
    /// The error in them.
    pub problem: UnitProblem,
}

/// The error in the text of a unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UnitProblem {
    /// No unit has this name.
    Unknown,
    /// A unit is missing here.
    Missing,
    /// This character has no meaning here.
    Unexpected,
    /// A power is not a whole number from -9 to 9, or is 0.
    Power,
    /// A parenthesis is open at the end.
    Open,
    /// The text is longer than [`MAX_LENGTH`] bytes.
    TooLong,
    /// The factor of the product is too great or too small.
    TooGreat,
}

impl fmt::Display for UnitProblem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Unknown => "unknown unit",
            Self::Missing => "expected a unit",
            Self::Unexpected => "expected `*`, `/`, `^` or the end of the unit",
            Self::Power => "expected a power from -9 to 9, and not 0",
            Self::Open => "expected `)`",
            Self::TooLong => "a unit has 64 bytes at most",
            Self::TooGreat => "the factor of this unit is too great or too small",
        })
    }
}

impl core::error::Error for UnitError {}

impl fmt::Display for UnitError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.problem.fmt(f)
    }
}

impl Unit {
    /// Reads a unit: named units with prefixes of the SI, joined by `*`, `·` or `/`, with powers
    /// (`^2`, `²`) and parentheses. Products are read from left to right, so `kg/m*s` is
    /// `(kg/m)*s`.
    ///
    /// # Errors
    /// The error in the text, and its byte.
    pub fn parse(text: &str) -> Result<Self, UnitError> {
        let fail = |range, problem| Err(UnitError { range, problem });
        if text.len() > MAX_LENGTH {
            return fail(0..text.len(), UnitProblem::TooLong);
        }
        // A unit that stands alone keeps its zero.
        if let Some(unit) = table::find(text.trim()) {
            return Ok(unit);
        }
        let mut parser = Parser { text, at: 0 };
        let unit = parser.product()?;
        match parser.next() {
            None => Ok(unit),
            Some(c) => fail(parser.at..parser.at + c.len_utf8(), UnitProblem::Unexpected),
        }
    }
}

/// A text of at most [`MAX_LENGTH`] bytes, which bounds the depth of its parentheses, too.
struct Parser<'a> {
    text: &'a str,
    /// The byte that is read next.
    at: usize,
}

impl Parser<'_> {
    /// The next character that is not a space.
    fn next(&mut self) -> Option<char> {
        let rest = &self.text[self.at..];
        let trimmed = rest.trim_start();
        self.at += rest.len() - trimmed.len();
        trimmed.chars().next()
    }

    fn take(&mut self, c: char) {
        self.at += c.len_utf8();
    }

    fn fail<T>(&self, start: usize, problem: UnitProblem) -> Result<T, UnitError> {
        Err(UnitError {
            range: start..self.at,
            problem,
        })
    }

    fn product(&mut self) -> Result<Unit, UnitError> {
        let mut product = Unit::ONE;
        let mut sign = 1;
        loop {
            let start = self.at;
            let (unit, power) = self.power()?;
            product = match product.times(unit, power * sign) {
                Some(product) => product,
                None => return self.fail(start, UnitProblem::TooGreat),
            };
            sign = match self.next() {
                Some(c @ ('*' | '·' | '⋅' | '/')) => {
                    self.take(c);
                    if c == '/' { -1 } else { 1 }
                }
                // A space, or a parenthesis, multiplies.
                Some(c) if c == '(' || is_of_name(c) => 1,
                _ => return Ok(product),
            };
        }
    }

    fn power(&mut self) -> Result<(Unit, i8), UnitError> {
        let unit = self.factor()?;
        let start = self.at;
        let rest = &self.text[self.at..];
        let power = if let Some(rest) = rest.strip_prefix('^').or_else(|| rest.strip_prefix("**")) {
            let digits = rest.trim_start_matches('-');
            let length = digits.bytes().take_while(u8::is_ascii_digit).count();
            let length = rest.len() - digits.len() + length;
            self.at = self.text.len() - rest.len() + length;
            rest[..length].parse().ok()
        } else {
            let Some((power, length)) = superscript(rest) else {
                return Ok((unit, 1));
            };
            self.at += length;
            power
        };
        match power {
            Some(power) if power != 0 && (-MAX_POWER..=MAX_POWER).contains(&power) => {
                Ok((unit, power))
            }
            _ => self.fail(start, UnitProblem::Power),
        }
    }

    fn factor(&mut self) -> Result<Unit, UnitError> {
        match self.next() {
            None => self.fail(self.at, UnitProblem::Missing),
            Some('(') => {
                self.take('(');
                let unit = self.product()?;
                match self.next() {
                    Some(')') => self.take(')'),
                    _ => return self.fail(self.at, UnitProblem::Open),
                }
                Ok(unit)
            }
            Some('1') => {
                self.take('1');
                Ok(Unit::ONE)
            }
            Some(c) if is_of_name(c) => {
                let start = self.at;
                let rest = &self.text[start..];
                // `g_0` is the only name with a digit.
                let length = if rest.starts_with("g_0") {
                    3
                } else {
                    rest.find(|c| !is_of_name(c)).unwrap_or(rest.len())
                };
                self.at += length;
                match table::find(&rest[..length]) {
                    Some(unit) => Ok(unit),
                    None => self.fail(start, UnitProblem::Unknown),
                }
            }
            Some(c) => {
                let start = self.at;
                self.take(c);
                self.fail(start, UnitProblem::Missing)
            }
        }
    }
}

/// Whether a character may be part of the name of a unit.
fn is_of_name(c: char) -> bool {
    c.is_alphabetic() || matches!(c, '°' | '%' | '‰' | '_' | '℃' | '℉')
}

/// A power in superscript at the start of a text, with its length in bytes. The power is `None` if
/// it is too long.
fn superscript(text: &str) -> Option<(Option<i8>, usize)> {
    let (negative, digits) = match text.strip_prefix('⁻') {
        Some(digits) => (true, digits),
        None => (false, text),
    };
    let mut length = text.len() - digits.len();
    let mut power = Some(0_i8);
    for c in digits.chars() {
        let Some(digit) = "⁰¹²³⁴⁵⁶⁷⁸⁹".chars().position(|d| d == c) else {
            break;
        };
        length += c.len_utf8();
        let digit = i8::try_from(digit).ok();
        power = power.and_then(|p| p.checked_mul(10)?.checked_add(digit?));
    }
    (length > 0).then_some((
        power.map(|power| if negative { -power } else { power }),
        length,
    ))
}
