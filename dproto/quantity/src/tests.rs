//! Texts of units, and conversions.

use crate::{Conversion, UNITS, Unit, UnitProblem, names};
use std::format;
use std::string::{String, ToString};
use std::vec::Vec;

fn unit(text: &str) -> Unit {
    Unit::parse(text).unwrap_or_else(|error| panic!("{text}: {error}"))
}

#[track_caller]
fn converts(value: f64, from: &str, to: &str, expected: f64) {
    let conversion = unit(from).conversion_to(&unit(to));
    let conversion = conversion.unwrap_or_else(|| panic!("{from} is no {to}"));
    assert_eq!(conversion.apply(value), expected, "{from} in {to}");
}

#[test]
fn definitions_convert_without_rounding() {
    converts(1500.0, "mm/s", "m/s", 1.5);
    converts(1.0, "km/h", "m/s", 1.0 / 3.6);
    converts(180.0, "deg", "rad", core::f64::consts::PI);
    converts(1.0, "rev", "deg", 360.0);
    converts(60.0, "rpm", "rev/s", 1.0);
    converts(100.0, "°C", "K", 373.15);
    converts(212.0, "°F", "°C", 100.0);
    converts(50.0, "%", "1", 0.5);
    converts(1.0, "kWh", "MJ", 3.6);
    converts(1.0, "in", "mm", 25.4);
    converts(2.0, "B", "bit", 16.0);
    converts(1.0, "kg*m^2", "g*mm^2", 1e9);
    converts(1.0, "L", "dm^3", 1.0);
    converts(3.0, "N", "kg*m/s^2", 3.0);
    converts(1.0, "V*A", "W", 1.0);
}

#[test]
fn one_unit_has_many_writings() {
    for (one, other) in [
        ("m/s^2", "m*s^-2"),
        ("m/s²", "m s⁻²"),
        ("m/s**2", "m/s/s"),
        ("kg/m*s", "(kg/m)*s"),
        ("kg/(m*s)", "kg/m/s"),
        ("1/s", "Hz"),
        ("µm", "um"),
        ("μm", "micrometre"),
        ("millimeter", "mm"),
        ("Celsius", "degC"),
        ("N·m", "N*m"),
        ("kilogram", "kg"),
        ("days", "d"),
        ("baud", "Bd"),
        ("kΩ", "kohm"),
        ("ml", "mL"),
    ] {
        assert_eq!(unit(one), unit(other), "{one} and {other}");
    }
}

#[test]
fn a_word_is_a_unit_before_it_is_a_prefix() {
    converts(1.0, "min", "s", 60.0);
    converts(1.0, "ft", "m", 0.3048);
    converts(1.0, "Pa", "N/m^2", 1.0);
    converts(1.0, "cd", "cd", 1.0);
}

#[test]
fn what_is_counted_does_not_convert() {
    for (one, other) in [
        ("rad", "1"),
        ("px", "bit"),
        ("px", "m"),
        ("Bd", "Hz"),
        ("rad/s", "Hz"),
        ("mm", "s"),
        ("dB", "%"),
    ] {
        assert_eq!(
            unit(one).conversion_to(&unit(other)),
            None,
            "{one}, {other}"
        );
    }
}

#[test]
fn differences_have_no_zero() {
    converts(1.0, "W/°C", "W/K", 1.0);
    converts(9.0, "K/s*s", "K", 9.0);
    assert_eq!(
        unit("°C")
            .conversion_to(&unit("°F"))
            .map(|c| c.to_string())
            .as_deref(),
        Some("×9/5 +32")
    );
    assert_eq!(
        unit("deg")
            .conversion_to(&unit("rad"))
            .map(|c| c.to_string())
            .as_deref(),
        Some("×π/180")
    );
    assert_eq!(
        unit("rad")
            .conversion_to(&unit("deg"))
            .map(|c| c.to_string())
            .as_deref(),
        Some("×180/π")
    );
}

#[track_caller]
fn fails(text: &str, at: &str, problem: UnitProblem) {
    let error = Unit::parse(text).expect_err(text);
    assert_eq!(
        (&text[error.range.clone()], error.problem),
        (at, problem),
        "{text}"
    );
}

#[test]
fn errors_name_their_place() {
    fails("m/sec2", "2", UnitProblem::Unexpected);
    fails("mtr/s", "mtr", UnitProblem::Unknown);
    fails("m/parsec", "parsec", UnitProblem::Unknown);
    fails("", "", UnitProblem::Missing);
    fails("m/", "", UnitProblem::Missing);
    fails("m**", "**", UnitProblem::Power);
    fails("m^99", "^99", UnitProblem::Power);
    fails("m^0", "^0", UnitProblem::Power);
    fails("m^--2", "^--2", UnitProblem::Power);
    fails("m²²²²", "²²²²", UnitProblem::Power);
    fails("(m/s", "", UnitProblem::Open);
    fails("m)", ")", UnitProblem::Unexpected);
    fails("[m]", "[", UnitProblem::Missing);
    fails("Tm^9*Tm^9", "Tm^9", UnitProblem::TooGreat);
    let long = "m*".repeat(40);
    fails(&long, &long, UnitProblem::TooLong);
    fails("a rather long unit", "a", UnitProblem::Unknown);
}

#[test]
fn hostile_texts_do_not_panic() {
    let pieces = [
        "m", "(", ")", "*", "/", "^", "-", "9", "²", "⁻", "°", "µ", " ", "kg", "1", "é", "_",
        "g_0", "\u{200b}",
    ];
    // A linear congruential generator: the same texts at each run.
    let mut state = 7_u64;
    for _ in 0..200_000 {
        let mut text = String::new();
        for _ in 0..state % 12 {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            text.push_str(pieces[usize::try_from(state >> 33).unwrap_or(0) % pieces.len()]);
        }
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        if let Err(error) = Unit::parse(&text) {
            assert!(text.get(error.range).is_some(), "{text}");
        }
    }
}

#[test]
fn the_table_is_in_order() {
    let mut words: Vec<&str> = UNITS
        .iter()
        .flat_map(|named| core::iter::once(&named.symbol).chain(named.aliases))
        .copied()
        .collect();
    let count = words.len();
    words.sort_unstable();
    words.dedup();
    assert_eq!(words.len(), count, "a word stands for two units");
    for word in names() {
        assert!(Unit::parse(word).is_ok(), "{word}");
    }
    for named in UNITS {
        let scale = named.unit.scale;
        let divisor = crate::scale::gcd(scale.numerator(), scale.denominator());
        assert_eq!(divisor, 1, "{} is not in lowest terms", named.symbol);
    }
}

#[test]
fn each_conversion_and_its_inverse_are_one() {
    for from in &UNITS {
        for to in &UNITS {
            let there = from.unit.conversion_to(&to.unit);
            let back = to.unit.conversion_to(&from.unit);
            assert_eq!(there.is_some(), back.is_some());
            let (Some(there), Some(back)) = (there, back) else {
                continue;
            };
            let pair = format!("{} and {}", from.symbol, to.symbol);
            assert_eq!(
                there.scale().times(back.scale()),
                Some(crate::Scale::ONE),
                "{pair}"
            );
            let value = back.apply(there.apply(12.5));
            assert!((value - 12.5).abs() < 1e-12 * 500.0, "{pair}: {value}");
        }
    }
}

#[test]
fn integers_are_rounded_to_the_nearest() {
    let cases = [
        ("mm", "m", 1499, Some(1)),
        ("mm", "m", 1500, Some(2)),
        ("mm", "m", -1500, Some(-2)),
        ("mm", "m", -1499, Some(-1)),
        ("m", "mm", i128::MAX, None),
        // Nanoseconds of today need more digits than an f64 has.
        (
            "ns",
            "us",
            1_790_000_000_123_456_789,
            Some(1_790_000_000_123_457),
        ),
        ("°C", "K", 20, Some(293)),
        ("°C", "°F", -40, Some(-40)),
        ("rad", "deg", 1, Some(57)),
        ("deg", "rad", -180, Some(-3)),
    ];
    for (from, to, value, expected) in cases {
        let conversion = unit(from).conversion_to(&unit(to)).expect("a conversion");
        assert_eq!(
            conversion.apply_integer(value),
            expected,
            "{value} {from} in {to}"
        );
    }
}

#[test]
fn the_code_of_a_conversion_is_read_again() {
    let mut codes = 0;
    for from in &UNITS {
        for to in &UNITS {
            if let Some(conversion) = from.unit.conversion_to(&to.unit) {
                let code = std::format!("{}", conversion.code());
                assert!(code.is_ascii(), "{code}");
                assert_eq!(Conversion::from_code(&code), Some(conversion), "{code}");
                codes += 1;
            }
        }
    }
    assert!(codes > 200, "{codes}");
    for wrong in [
        "", "0", "1/0", "1p", "1/2/3", "m", "1+", "1-/2", "1+1/0", "é", "1p200",
    ] {
        assert_eq!(Conversion::from_code(wrong), None, "{wrong}");
    }
}

#[test]
fn a_factor_counts_its_operations() {
    let operations = |from, to| {
        let conversion = unit(from).conversion_to(&unit(to)).expect("a conversion");
        conversion.factor().operations()
    };
    assert_eq!(operations("m", "m"), 0);
    assert_eq!(operations("mm", "m"), 1);
    assert_eq!(operations("deg", "rad"), 2);
    assert_eq!(operations("°C", "°F"), 3);
}

/// The table of docs/units.md.
fn page_table() -> String {
    let mut page = String::from(
        "| unit | QUDT | other words | prefixes | in base units |\n|---|---|---|---|---|\n",
    );
    let code = |word: &str| {
        if word.is_empty() {
            String::new()
        } else {
            format!("`{word}`")
        }
    };
    for named in UNITS {
        let aliases: Vec<String> = named.aliases.iter().map(|alias| code(alias)).collect();
        let (symbol, qudt) = (code(named.symbol), code(named.qudt));
        let prefixes = if named.prefixed { "yes" } else { "" };
        let (scale, dimension) = (named.unit.scale, named.unit.dimension);
        page += &format!(
            "| {symbol} | {qudt} | {} | {prefixes} | {scale} {dimension} |\n",
            aliases.join(", ")
        );
    }
    page
}

#[test]
fn the_page_lists_all_units() {
    let page = include_str!("../../../docs/units.md");
    let table = page_table();
    assert!(
        page.contains(&table),
        "docs/units.md should contain\n{table}"
    );
}
