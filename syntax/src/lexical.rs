//! Checks of characters, escapes and numbers, which are the same in all languages and need no
//! grammar.

use crate::literal::{Escape, escape};
use crate::scan::{SegmentKind, segments};
use rc_diagnostics::{Diagnostic, SourceId, Span, stray_character};
use rc_vocabulary::duration;
use std::time::Duration;

/// Units of time of other languages, as people write them after a number.
const FOREIGN_UNITS: [&str; 27] = [
    "m", "mins", "minute", "minutes", "sec", "secs", "second", "seconds", "hr", "hour", "hours",
    "d", "day", "days", "msec", "msecs", "millis", "usec", "usecs", "micros", "ns", "nsec",
    "nanos", "Hz", "hz", "HZ", "kHz",
];

/// The findings of `text`, in order. The parser skips the declarations around the errors.
pub(crate) fn check(text: &str, source: SourceId, has_durations: bool) -> Vec<Diagnostic> {
    let mut found = Vec::new();
    for (kind, start, stop) in segments(text) {
        let piece = Piece {
            text: &text[start..stop],
            start,
            source,
            has_durations,
        };
        match kind {
            SegmentKind::Comment => {}
            SegmentKind::String => piece.escapes(&mut found),
            SegmentKind::Code => {
                piece.characters(&mut found);
                piece.numbers(&mut found);
            }
        }
    }
    found
}

struct Piece<'a> {
    text: &'a str,
    start: usize,
    source: SourceId,
    /// Whether a word after a number is a unit of time.
    has_durations: bool,
}

impl Piece<'_> {
    fn span(&self, at: usize, length: usize) -> Span {
        Span::new(self.source, self.start + at, self.start + at + length)
    }

    fn escapes(&self, found: &mut Vec<Diagnostic>) {
        let mut at = 0;
        while let Some(next) = self.text[at..].find('\\') {
            at += next;
            at += match escape(&self.text[at..]) {
                Escape::Character(_, length) => length,
                Escape::Unknown(length) => {
                    let written = &self.text[at..at + length];
                    let message = format!("unknown escape `{written}`");
                    let help = match written.as_bytes() {
                        [b'\\', b'u', ..] => {
                            "write the code point in braces, as in `\\u{e9}`".to_owned()
                        }
                        [b'\\'] => "a string ends on the line on which it begins".to_owned(),
                        _ => format!(
                            "write `\\{written}` for a backslash; the escapes are `\\n`, `\\r`, \
                             `\\t`, `\\\"`, `\\\\` and `\\u{{…}}`"
                        ),
                    };
                    let span = self.span(at, length);
                    found.push(Diagnostic::error("unknown-escape", span, message).help(help));
                    length
                }
            };
        }
    }

    /// Reports characters that no rule matches and that are invisible or easily mistaken for
    /// others.
    fn characters(&self, found: &mut Vec<Diagnostic>) {
        for (at, c) in self.text.char_indices() {
            // The parser shows a letter or a sign at its place.
            found.extend(stray_character(c, self.span(at, c.len_utf8())));
        }
    }

    /// Reports numbers with leading zeros, and with units that are none.
    fn numbers(&self, found: &mut Vec<Diagnostic>) {
        let bytes = self.text.as_bytes();
        let is_word = |at: usize| {
            let byte = bytes.get(at);
            byte.is_some_and(|b| b.is_ascii_alphanumeric() || matches!(b, b'_' | b'.'))
        };
        let length_of = |from: usize, test: fn(u8) -> bool| {
            let rest = bytes.get(from..).unwrap_or_default();
            rest.iter().take_while(|b| test(**b)).count()
        };
        let letter: fn(u8) -> bool = |b| b.is_ascii_alphanumeric() || b == b'_';
        let mut at = 0;
        while at < bytes.len() {
            if !bytes[at].is_ascii_digit() {
                // The digits of a name are not a number.
                at += length_of(at, letter).max(1);
                continue;
            }
            let begins = at;
            let digits = length_of(at, |b| b.is_ascii_digit());
            let decimal = !matches!(bytes.get(at + digits), Some(b'.' | b'e' | b'E' | b'x'));
            at = end_of_number(bytes, at);
            if decimal && digits > 1 && bytes[begins] == b'0' {
                self.leading_zero(begins, digits, found);
            }
            let hexadecimal = self.text[begins..].starts_with("0x");
            let joined = length_of(at, letter);
            let blank = length_of(at, |b| b == b' ' || b == b'\t');
            let (word, known) = if joined > 0 {
                (at..at + joined, false)
            } else {
                let from = at + blank;
                let word = from..from + length_of(from, letter);
                let known = !FOREIGN_UNITS.contains(&&self.text[word.clone()]);
                (word, known || blank == 0)
            };
            let unit = &self.text[word.clone()];
            if self.has_durations && !known && !hexadecimal && !duration::is_unit(unit) {
                let message = format!("unknown unit of time `{unit}`");
                let span = self.span(word.start, word.len());
                let diagnostic = Diagnostic::error("unknown-time-unit", span, message);
                let period = period_of(&self.text[begins..word.end], &self.text[begins..at], unit);
                let help = period.unwrap_or_else(|| {
                    match unit {
                        "m" | "mins" | "minute" | "minutes" => "write `min` for minutes",
                        "sec" | "secs" | "second" | "seconds" => "write `s` for seconds",
                        "hour" | "hours" | "hr" => "write `h` for hours",
                        _ => "the units are `us`, `ms`, `s`, `min` and `h`",
                    }
                    .to_owned()
                });
                found.push(diagnostic.help(help));
            }
            at += joined;
            // `1.2.3` is not a number, and reported once.
            while is_word(at) {
                at += 1;
            }
        }
    }

    fn leading_zero(&self, at: usize, digits: usize, found: &mut Vec<Diagnostic>) {
        let written = &self.text[at..at + digits];
        let meant = written.trim_start_matches('0');
        let meant = if meant.is_empty() { "0" } else { meant };
        let message = format!("`{written}` is the decimal number {meant}, not an octal one");
        let diagnostic = Diagnostic::warning("leading-zero", self.span(at, digits), message);
        found.push(diagnostic.help(format!("write `{meant}`")));
    }
}

/// What to write for a frequency, where it is in whole microseconds.
fn period_of(written: &str, number: &str, unit: &str) -> Option<String> {
    let hertz = match unit.to_lowercase().as_str() {
        "hz" => 1.0,
        "khz" => 1e3,
        _ => return None,
    };
    let hertz = hertz * number.parse::<f64>().ok()?;
    let period = Duration::try_from_secs_f64(1.0 / hertz).ok()?;
    let micros = u64::try_from(period.as_micros()).ok()?;
    let period = duration::text(micros.checked_mul(1000)?);
    (micros > 0).then(|| format!("{written} is a period of `{period}`"))
}

/// The end of the number that begins at `at`, without a unit.
fn end_of_number(bytes: &[u8], at: usize) -> usize {
    let digits = |from: usize, hexadecimal: bool| {
        let rest = bytes.get(from..).unwrap_or_default();
        let digit = |b: &&u8| b.is_ascii_digit() || hexadecimal && b.is_ascii_hexdigit();
        from + rest.iter().take_while(digit).count()
    };
    if bytes[at..].starts_with(b"0x") {
        return digits(at + 2, true);
    }
    let mut end = digits(at, false);
    if bytes.get(end) == Some(&b'.') {
        let fraction = digits(end + 1, false);
        end = if fraction > end + 1 { fraction } else { end };
    }
    if matches!(bytes.get(end), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(bytes.get(end + 1), Some(b'+' | b'-')));
        let exponent = digits(end + 1 + sign, false);
        end = if exponent > end + 1 + sign {
            exponent
        } else {
            end
        };
    }
    end
}

#[cfg(test)]
mod tests {
    use super::*;
    use rc_diagnostics::{Diagnostics, Format, SourceMap, render};

    fn found(text: &str) -> String {
        let mut sources = SourceMap::new();
        let source = sources.add("a", text);
        let mut found = Diagnostics::new();
        found.extend(check(text, source, true));
        render(&sources, &found, Format::Short)
    }

    #[test]
    fn characters_that_nobody_sees_are_named_at_their_place() {
        for (c, name) in [
            ('\u{a0}', "U+00A0 (a no-break space)"),
            ('\u{200b}', "U+200B (a zero-width space)"),
            ('\u{c}', "U+000C (a form feed)"),
            ('\u{2028}', "U+2028 (a line separator)"),
            ('\u{201c}', "U+201C (a typographic quote)"),
            ('\u{2013}', "U+2013 (a dash)"),
            ('\u{1}', "U+0001 (an invisible character)"),
            ('\u{3000}', "U+3000 (a foreign space)"),
            ('\u{3164}', "U+3164 (an invisible character)"),
            ('\u{2800}', "U+2800 (an invisible character)"),
        ] {
            let text = found(&format!("int{c}a; // {c}\n\"{c}\""));
            let wanted = format!("a:1:4: error[stray-character]: unexpected character {name} (");
            assert!(text.starts_with(&wanted), "{text}");
            assert_eq!(text.lines().count(), 1, "{text}");
        }
        assert_eq!(found("größe = 1;\r\n\tb"), "");
    }

    #[test]
    fn unknown_escapes_list_the_known_ones() {
        assert_eq!(found(r#""\n\r\t\"\\\u{e9}\u{10FFFF}""#), "");
        let text = found(r#"x "\d+\.csv";"#);
        assert!(text.contains("a:1:4: error[unknown-escape]: unknown escape `\\d` ("));
        assert!(text.contains(r"the escapes are `\n`, `\r`, `\t`"), "{text}");
        assert_eq!(text.lines().count(), 2, "{text}");
        for (escape, wanted) in [
            (r"\u00e9", r"`\u`"),
            (r"\u{}", r"`\u`"),
            (r"\u{d800}", r"`\u`"),
        ] {
            let text = found(&format!("\"{escape}\""));
            assert!(text.contains(wanted), "{text}");
            assert!(text.contains(r"as in `\u{e9}`"), "{text}");
        }
        assert!(found("\"a\\\nb\"").contains("a string ends on the line"));
    }

    #[test]
    fn leading_zeros_and_units_that_are_none() {
        for text in [
            "0", "0.5", "1.05", "0x010", "1e010", "x010", "a_01", "10ms", "2 min", "1 m2", "3 T",
            "0e1", "-0.0 s", "a[1]", "0:127",
        ] {
            assert_eq!(found(text), "", "{text}");
        }
        let text = found("x = -010;\n00 08ms");
        assert!(text.contains("a:1:6: warning[leading-zero]: `010` is the decimal number 10"));
        assert!(text.contains("a:2:1: warning[leading-zero]: `00` is the decimal number 0"));
        assert!(
            text.contains("a:2:4: warning[leading-zero]: `08`"),
            "{text}"
        );
        for (text, unit) in [
            ("2m", "m"),
            ("3 sec", "sec"),
            ("1.5e3hz", "hz"),
            ("1 d;", "d"),
            ("5 kHz", "kHz"),
        ] {
            let shown = found(text);
            assert!(
                shown.contains(&format!("unknown unit of time `{unit}`")),
                "{shown}"
            );
        }
        for (text, period) in [("10 Hz", "100ms"), ("0.5hz", "2s"), ("3 kHz", "333us")] {
            let shown = found(text);
            let help = format!("{text} is a period of `{period}`)");
            assert!(shown.contains(&help), "{shown}");
        }
        assert!(found("0 Hz").contains("(the units are"));
    }
}
