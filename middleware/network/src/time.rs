//! Times as they stand in settings.

/// The milliseconds of a time such as `500ms`, as the checker of settings writes it.
pub fn milliseconds(text: &str) -> Option<u64> {
    let split = text.find(|c: char| c.is_ascii_alphabetic())?;
    let number: u64 = text[..split].parse().ok()?;
    match &text[split..] {
        "ns" => Some(number / 1_000_000),
        "us" => Some(number / 1000),
        "ms" => Some(number),
        "s" => number.checked_mul(1000),
        "min" => number.checked_mul(60_000),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_those_of_the_checker() {
        assert_eq!(milliseconds("500ms"), Some(500));
        assert_eq!(milliseconds("2s"), Some(2000));
        assert_eq!(milliseconds("150000us"), Some(150));
        assert_eq!(milliseconds("soon"), None);
    }
}
