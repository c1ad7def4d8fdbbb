//! Times as people write them, in descriptions and in configurations alike.

/// A time as it is written (`50ms`, `1.5 s`, `2min`, `10us`), in nanoseconds.
pub fn duration_nanoseconds(text: &str) -> Option<u64> {
    let split = text.find(|c: char| c.is_ascii_alphabetic() && c != 'e' && c != 'E')?;
    let value: f64 = text[..split].trim().parse().ok()?;
    let unit = match text[split..].trim() {
        "us" => 1e3,
        "ms" => 1e6,
        "s" => 1e9,
        "min" => 60e9,
        _ => return None,
    };
    (value >= 0.0).then(|| (value * unit).round() as u64)
}

/// The shortest text in whole numbers that [`duration_nanoseconds`] reads as `nanoseconds` again.
pub fn duration_text(nanoseconds: u64) -> String {
    match nanoseconds {
        0 => "0ms".to_owned(),
        ns if ns % 1_000_000_000 == 0 => format!("{}s", ns / 1_000_000_000),
        ns if ns % 1_000_000 == 0 => format!("{}ms", ns / 1_000_000),
        ns if ns % 1_000 == 0 => format!("{}us", ns / 1_000),
        ns => format!("{}.{:03}us", ns / 1_000, ns % 1_000),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_is_read_as_it_was_written() {
        for (text, ns) in [
            ("10us", 10_000),
            ("50ms", 50_000_000),
            ("3s", 3_000_000_000),
            ("1.500us", 1_500),
        ] {
            assert_eq!(duration_nanoseconds(text), Some(ns));
            assert_eq!(duration_text(ns), text);
        }
        assert_eq!(duration_nanoseconds("2min"), Some(120_000_000_000));
        assert_eq!(duration_nanoseconds("-1s"), None);
        assert_eq!(duration_nanoseconds("50"), None);
    }
}
