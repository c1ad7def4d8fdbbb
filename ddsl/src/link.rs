//! Capacities of links: `link "100 Mbit/s";`.

use rc_diagnostics::Diagnostic;
use rc_quantity::Unit;
use rc_syntax::Name;

/// Reads the capacity of a link, in bits a second.
pub(crate) fn read(written: &Name) -> Result<f64, Diagnostic> {
    let text = written.text.trim();
    let at = text.find(|c: char| !c.is_ascii_digit() && c != '.');
    let (number, unit) = text.split_at(at.unwrap_or(text.len()));
    let bits = || {
        let number: f64 = number.parse().ok()?;
        let to = Unit::parse("bit/s").ok()?;
        let bits = Unit::parse(unit).ok()?.conversion_to(&to)?.apply(number);
        (bits.is_finite() && bits > 0.0).then_some(bits)
    };
    bits().ok_or_else(|| {
        let message = format!("`{}` is no capacity of a link", written.text);
        let error = Diagnostic::error("bad-link", written.span, message);
        error.help("write a number and a unit of bits or bytes a second, such as `100 Mbit/s` or `12.5 MB/s`")
    })
}

/// A rate as a text, such as `12.5 Mbit/s`.
pub fn text(bits: f64) -> String {
    let units = [(1e9, "Gbit/s"), (1e6, "Mbit/s"), (1e3, "kbit/s")];
    let unit = units.iter().find(|(size, _)| bits >= *size);
    let (size, unit) = unit.unwrap_or(&(1.0, "bit/s"));
    let rounded = (bits / size * 10.0).round() / 10.0;
    format!("{rounded} {unit}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use rc_diagnostics::{SourceMap, Span};

    #[test]
    fn a_capacity_is_a_number_with_a_unit_of_bits_a_second() {
        let mut sources = SourceMap::new();
        let source = sources.add("robot.ddsl", String::new());
        let span = Span::new(source, 0, 0);
        let bits = |text: &str| read(&Name::new(text, span)).ok();
        assert_eq!(bits("54 Mbit/s"), Some(54e6));
        assert_eq!(bits("12.5MB/s"), Some(1e8));
        assert_eq!(bits("1 Gbit/s"), Some(1e9));
        for wrong in [
            "",
            "54",
            "Mbit/s",
            "-1 Mbit/s",
            "0 Mbit/s",
            "54 Mbit",
            "5 m/s",
            "1.2.3 bit/s",
        ] {
            assert_eq!(bits(wrong), None, "{wrong}");
        }
        assert_eq!(text(12_540_000.0), "12.5 Mbit/s");
        assert_eq!(text(900.0), "900 bit/s");
    }
}
