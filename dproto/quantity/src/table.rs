//! The named units, with the factors of their definitions.
//!
//! Sources: the SI brochure (9th edition, 2019) for units of the SI and those that it accepts, and
//! NIST Special Publication 811 (2008) for those of the inch and pound. The names are those of the
//! vocabulary QUDT (<https://qudt.org/vocab/unit/>).

use crate::conversion::Offset;
use crate::dimension::{
    Base::{
        self, Amount, Angle, Current, Information, Length, Level, LuminousIntensity, Mass, Pixel,
        Symbol, Temperature, Time,
    },
    Dimension,
};
use crate::scale::Scale;
use crate::unit::Unit;

/// A unit with a name of its own.
#[derive(Clone, Copy, Debug)]
pub struct NamedUnit {
    /// The symbol, as texts of units should have it: `mm` has the symbol `m` with a prefix.
    pub symbol: &'static str,
    /// The name in QUDT, and an empty text if QUDT has none.
    pub qudt: &'static str,
    /// Other words that mean the same.
    pub aliases: &'static [&'static str],
    /// Whether prefixes of the SI are allowed before the symbol.
    pub prefixed: bool,
    /// The meaning.
    pub unit: Unit,
}

/// A prefix of the SI.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Prefix {
    /// The symbol, `m` in `mm`.
    pub symbol: &'static str,
    /// The word, `milli` in `millimetre`.
    pub word: &'static str,
    /// The power of ten.
    pub exponent: i8,
}

/// The prefixes of the SI, from 10^-15 to 10^15.
pub(crate) const PREFIXES: [Prefix; 15] = [
    prefix("f", "femto", -15),
    prefix("p", "pico", -12),
    prefix("n", "nano", -9),
    prefix("µ", "micro", -6),
    // The Greek letter, which keyboards and documents have as often as the micro sign.
    prefix("μ", "micro", -6),
    prefix("u", "micro", -6),
    prefix("m", "milli", -3),
    prefix("c", "centi", -2),
    prefix("d", "deci", -1),
    prefix("h", "hecto", 2),
    prefix("k", "kilo", 3),
    prefix("M", "mega", 6),
    prefix("G", "giga", 9),
    prefix("T", "tera", 12),
    prefix("P", "peta", 15),
];

const fn prefix(symbol: &'static str, word: &'static str, exponent: i8) -> Prefix {
    Prefix {
        symbol,
        word,
        exponent,
    }
}

/// A unit of the SI, which allows prefixes.
const fn si(
    symbol: &'static str,
    qudt: &'static str,
    aliases: &'static [&'static str],
    powers: &[(Base, i8)],
) -> NamedUnit {
    NamedUnit {
        prefixed: true,
        ..other(symbol, qudt, aliases, powers, (1, 1))
    }
}

/// Another unit: so many of the base units of its dimension.
const fn other(
    symbol: &'static str,
    qudt: &'static str,
    aliases: &'static [&'static str],
    powers: &[(Base, i8)],
    (numerator, denominator): (u128, u128),
) -> NamedUnit {
    NamedUnit {
        symbol,
        qudt,
        aliases,
        prefixed: false,
        unit: Unit {
            dimension: Dimension::of(powers),
            scale: Scale::ratio(numerator, denominator),
            zero: Offset::ZERO,
        },
    }
}

/// A unit that allows prefixes although its factor is not 1.
const fn prefixed(unit: NamedUnit) -> NamedUnit {
    NamedUnit {
        prefixed: true,
        ..unit
    }
}

/// An angle: so many π.
const fn angle(
    symbol: &'static str,
    qudt: &'static str,
    aliases: &'static [&'static str],
    powers: &[(Base, i8)],
    (numerator, denominator): (u128, u128),
) -> NamedUnit {
    let mut named = other(symbol, qudt, aliases, powers, (1, 1));
    named.unit.scale = Scale::ratio_of_pi(numerator, denominator);
    named
}

/// A temperature whose zero is `zero` kelvins.
const fn temperature(
    symbol: &'static str,
    qudt: &'static str,
    aliases: &'static [&'static str],
    scale: (u128, u128),
    zero: (i128, u128),
) -> NamedUnit {
    let mut named = other(symbol, qudt, aliases, &[(Temperature, 1)], scale);
    named.unit.zero = Offset {
        numerator: zero.0,
        denominator: zero.1,
    };
    named
}

const FORCE: [(Base, i8); 3] = [(Mass, 1), (Length, 1), (Time, -2)];
const PRESSURE: [(Base, i8); 3] = [(Mass, 1), (Length, -1), (Time, -2)];
const ENERGY: [(Base, i8); 3] = [(Mass, 1), (Length, 2), (Time, -2)];
const POWER: [(Base, i8); 3] = [(Mass, 1), (Length, 2), (Time, -3)];
const VELOCITY: [(Base, i8); 2] = [(Length, 1), (Time, -1)];

/// All named units, by their quantities.
pub const UNITS: [NamedUnit; 75] = [
    other("1", "UNITLESS", &[], &[], (1, 1)),
    other("%", "PERCENT", &["percent"], &[], (1, 100)),
    other("‰", "PERMILLE", &["permille"], &[], (1, 1000)),
    other("ppm", "PPM", &[], &[], (1, 1_000_000)),
    other("ppb", "PPB", &[], &[], (1, 1_000_000_000)),
    // Lengths, areas and volumes.
    si(
        "m",
        "M",
        &["metre", "meter", "metres", "meters"],
        &[(Length, 1)],
    ),
    other("in", "IN", &["inch", "inches"], &[(Length, 1)], (127, 5000)),
    other("ft", "FT", &["foot", "feet"], &[(Length, 1)], (381, 1250)),
    other("yd", "YD", &["yard", "yards"], &[(Length, 1)], (1143, 1250)),
    other(
        "mi",
        "MI",
        &["mile", "miles"],
        &[(Length, 1)],
        (201_168, 125),
    ),
    other("nmi", "MI_N", &[], &[(Length, 1)], (1852, 1)),
    other("ha", "HA", &["hectare"], &[(Length, 2)], (10_000, 1)),
    prefixed(other(
        "L",
        "L",
        &["l", "litre", "liter"],
        &[(Length, 3)],
        (1, 1000),
    )),
    // Masses.
    prefixed(other(
        "g",
        "GM",
        &["gram", "grams"],
        &[(Mass, 1)],
        (1, 1000),
    )),
    other("t", "TONNE", &["tonne", "tonnes"], &[(Mass, 1)], (1000, 1)),
    other(
        "lb",
        "LB",
        &["pound", "pounds"],
        &[(Mass, 1)],
        (45_359_237, 100_000_000),
    ),
    other(
        "oz",
        "OZ",
        &["ounce", "ounces"],
        &[(Mass, 1)],
        (45_359_237, 1_600_000_000),
    ),
    // Times and frequencies.
    si("s", "SEC", &["sec", "second", "seconds"], &[(Time, 1)]),
    other("min", "MIN", &["minute", "minutes"], &[(Time, 1)], (60, 1)),
    other("h", "HR", &["hour", "hours"], &[(Time, 1)], (3600, 1)),
    other("d", "DAY", &["day", "days"], &[(Time, 1)], (86_400, 1)),
    other("wk", "WK", &["week", "weeks"], &[(Time, 1)], (604_800, 1)),
    si("Hz", "HZ", &["hertz"], &[(Time, -1)]),
    prefixed(other(
        "Bd",
        "BAUD",
        &["baud"],
        &[(Symbol, 1), (Time, -1)],
        (1, 1),
    )),
    // Angles.
    si("rad", "RAD", &["radian", "radians"], &[(Angle, 1)]),
    angle(
        "deg",
        "DEG",
        &["°", "degree", "degrees"],
        &[(Angle, 1)],
        (1, 180),
    ),
    angle("arcmin", "ARCMIN", &[], &[(Angle, 1)], (1, 10_800)),
    angle("arcsec", "ARCSEC", &[], &[(Angle, 1)], (1, 648_000)),
    angle(
        "rev",
        "REV",
        &["turn", "turns", "revolution", "revolutions"],
        &[(Angle, 1)],
        (2, 1),
    ),
    angle("gon", "GON", &["grad"], &[(Angle, 1)], (1, 200)),
    angle(
        "rpm",
        "REV-PER-MIN",
        &[],
        &[(Angle, 1), (Time, -1)],
        (1, 30),
    ),
    si("sr", "SR", &["steradian"], &[(Angle, 2)]),
    // Velocities and accelerations.
    other("kn", "KN", &["knot", "knots"], &VELOCITY, (463, 900)),
    other("mph", "MI-PER-HR", &[], &VELOCITY, (1397, 3125)),
    other(
        "g_0",
        "G",
        &["gn"],
        &[(Length, 1), (Time, -2)],
        (196_133, 20_000),
    ),
    // Forces, pressures, energies, powers.
    si("N", "N", &["newton", "newtons"], &FORCE),
    other("kgf", "KiloGM_F", &[], &FORCE, (196_133, 20_000)),
    other(
        "lbf",
        "LB_F",
        &[],
        &FORCE,
        (8_896_443_230_521, 2_000_000_000_000),
    ),
    other("dyn", "DYN", &[], &FORCE, (1, 100_000)),
    si("Pa", "PA", &["pascal"], &PRESSURE),
    prefixed(other("bar", "BAR", &[], &PRESSURE, (100_000, 1))),
    other("atm", "ATM", &[], &PRESSURE, (101_325, 1)),
    other("Torr", "TORR", &["torr"], &PRESSURE, (20_265, 152)),
    other(
        "mmHg",
        "MilliM_HG",
        &[],
        &PRESSURE,
        (26_664_477_483, 200_000_000),
    ),
    other(
        "psi",
        "PSI",
        &[],
        &PRESSURE,
        (8_896_443_230_521, 1_290_320_000),
    ),
    si("J", "J", &["joule", "joules"], &ENERGY),
    prefixed(other("Wh", "W-HR", &[], &ENERGY, (3600, 1))),
    prefixed(other(
        "eV",
        "EV",
        &[],
        &ENERGY,
        (801_088_317, 5_000_000_000_000_000_000_000_000_000),
    )),
    prefixed(other("cal", "CAL_TH", &[], &ENERGY, (523, 125))),
    si("W", "W", &["watt", "watts"], &POWER),
    si("VA", "V-A", &[], &POWER),
    other(
        "hp",
        "HP",
        &["horsepower"],
        &POWER,
        (37_284_993_579_113_511, 50_000_000_000_000),
    ),
    // Electricity and magnetism.
    si("A", "A", &["ampere", "amperes", "amp"], &[(Current, 1)]),
    si("C", "C", &["coulomb"], &[(Current, 1), (Time, 1)]),
    prefixed(other(
        "Ah",
        "A-HR",
        &[],
        &[(Current, 1), (Time, 1)],
        (3600, 1),
    )),
    si(
        "V",
        "V",
        &["volt", "volts"],
        &[(Mass, 1), (Length, 2), (Time, -3), (Current, -1)],
    ),
    si(
        "Ω",
        "OHM",
        &["\u{2126}", "ohm", "ohms", "Ohm"],
        &[(Mass, 1), (Length, 2), (Time, -3), (Current, -2)],
    ),
    si(
        "S",
        "S",
        &["siemens"],
        &[(Mass, -1), (Length, -2), (Time, 3), (Current, 2)],
    ),
    si(
        "F",
        "FARAD",
        &["farad"],
        &[(Mass, -1), (Length, -2), (Time, 4), (Current, 2)],
    ),
    si(
        "H",
        "H",
        &["henry"],
        &[(Mass, 1), (Length, 2), (Time, -2), (Current, -2)],
    ),
    si(
        "Wb",
        "WB",
        &["weber"],
        &[(Mass, 1), (Length, 2), (Time, -2), (Current, -1)],
    ),
    si(
        "T",
        "T",
        &["tesla"],
        &[(Mass, 1), (Time, -2), (Current, -1)],
    ),
    prefixed(other(
        "G",
        "GAUSS",
        &["gauss"],
        &[(Mass, 1), (Time, -2), (Current, -1)],
        (1, 10_000),
    )),
    // Temperatures and amounts.
    si("K", "K", &["kelvin"], &[(Temperature, 1)]),
    temperature(
        "°C",
        "DEG_C",
        &["℃", "degC", "celsius", "Celsius"],
        (1, 1),
        (5463, 20),
    ),
    temperature(
        "°F",
        "DEG_F",
        &["℉", "degF", "fahrenheit", "Fahrenheit"],
        (5, 9),
        (45_967, 180),
    ),
    si("mol", "MOL", &["mole", "moles"], &[(Amount, 1)]),
    // Light.
    si("cd", "CD", &["candela"], &[(LuminousIntensity, 1)]),
    si(
        "lm",
        "LM",
        &["lumen"],
        &[(LuminousIntensity, 1), (Angle, 2)],
    ),
    si(
        "lx",
        "LUX",
        &["lux"],
        &[(LuminousIntensity, 1), (Angle, 2), (Length, -2)],
    ),
    // Information and counted things.
    si("bit", "BIT", &["bits"], &[(Information, 1)]),
    prefixed(other(
        "B",
        "BYTE",
        &["byte", "bytes"],
        &[(Information, 1)],
        (8, 1),
    )),
    other("px", "", &["pixel", "pixels"], &[(Pixel, 1)], (1, 1)),
    other("Sym", "", &["symbol", "symbols"], &[(Symbol, 1)], (1, 1)),
    // Decibels with different references cannot be distinguished here, so prefixes would only
    // mislead.
    other("dB", "DeciB", &["decibel"], &[(Level, 1)], (1, 1)),
];

/// The meaning of a word. A unit is preferred to another one with a prefix: `min` is a minute.
pub(crate) fn find(word: &str) -> Option<Unit> {
    let whole = |word: &str, prefixed: bool| {
        UNITS.iter().find(|named| {
            (named.prefixed || !prefixed) && (named.symbol == word || named.aliases.contains(&word))
        })
    };
    if let Some(named) = whole(word, false) {
        return Some(named.unit);
    }
    PREFIXES.iter().find_map(|prefix| {
        let symbol = |rest: &str| {
            let named = UNITS
                .iter()
                .find(|named| named.prefixed && named.symbol == rest);
            // `l`, the sign of the ohm and `ohm` are other writings of a symbol.
            let written = ["l", "\u{2126}", "ohm"].contains(&rest);
            named.or_else(|| whole(rest, true).filter(|_| written))
        };
        let short = word.strip_prefix(prefix.symbol).and_then(symbol);
        let named = short.or_else(|| {
            let rest = word.strip_prefix(prefix.word)?;
            whole(rest, true).filter(|named| named.symbol != rest)
        })?;
        let mut unit = named.unit;
        unit.scale = unit
            .scale
            .times(Scale::ratio(10, 1).to_the(prefix.exponent)?)?;
        Some(unit)
    })
}

/// Words of units for a comparison with a misspelled one: all symbols and aliases, and the usual
/// units with a prefix.
pub fn names() -> impl Iterator<Item = &'static str> {
    const WITH_PREFIX: [&str; 24] = [
        "mm", "cm", "km", "µm", "nm", "kg", "mg", "ms", "us", "µs", "ns", "mrad", "kHz", "MHz",
        "GHz", "mA", "mV", "kV", "kW", "kPa", "hPa", "mAh", "kB", "MB",
    ];
    let own = UNITS
        .iter()
        .flat_map(|named| core::iter::once(named.symbol).chain(named.aliases.iter().copied()));
    own.chain(WITH_PREFIX)
}
