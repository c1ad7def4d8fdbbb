//! Comparison of two units.

use rc_quantity::{Conversion, Unit};

/// The conversion of numbers in one unit into numbers in another one. `None` if they measure
/// different quantities, or if one of them is not a unit.
pub fn conversion(one: &str, other: &str) -> Option<Conversion> {
    Unit::parse(one)
        .ok()?
        .conversion_to(&Unit::parse(other).ok()?)
}

/// Whether a number in one unit is the same number in the other one: `l` and `dm^3`. Texts that are
/// not units must be equal.
pub fn is_same_unit(one: &str, other: &str) -> bool {
    one == other || conversion(one, other).is_some_and(|conversion| conversion.is_identity())
}

/// The relation of two units, for a help: `1 g is 0.001 kg`.
pub fn compared_units(one: &str, other: &str) -> String {
    match conversion(one, other) {
        // A scale with an offset has no factor: 1 °C is 274.15 K, but 2 °C are 275.15 K.
        Some(conversion) if conversion.offset() == 0.0 => {
            format!("1 {one} is {} {other}", conversion.apply(1.0))
        }
        Some(_) => format!("`{one}` and `{other}` are two scales of one quantity"),
        None => format!("`{one}` and `{other}` measure different things"),
    }
}
