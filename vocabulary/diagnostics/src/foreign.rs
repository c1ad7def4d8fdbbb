//! Text from outside: other programs, other components, the network.
//!
//! The receiver of such a text passes it through [`clean`] where it enters. Then no message, log,
//! terminal or JSON contains a forged line, or more of the text than it needs.

use std::borrow::Cow;

/// How many characters of a foreign text are kept.
pub const MOST: usize = 256;

/// The text without its colours and with control characters shown as escapes, cut after [`MOST`]
/// characters.
///
/// Characters that change the direction of text, and other invisible ones, count as control
/// characters. A cut text ends with `…`. To clean a text twice changes nothing.
///
/// ```
/// use rc_diagnostics::foreign::clean;
///
/// assert_eq!(clean("lidar\n\u{1b}[2J"), "lidar\\n\\u{1b}[2J");
/// assert_eq!(clean("\u{1b}[32m INFO\u{1b}[0m"), " INFO");
/// assert_eq!(clean(&"x".repeat(1000)), format!("{}…", "x".repeat(256)));
/// ```
pub fn clean(text: &str) -> String {
    clean_to(text, MOST)
}

/// [`clean`] for bytes. U+FFFD replaces invalid UTF-8.
pub fn clean_bytes(bytes: &[u8]) -> String {
    // No character is longer than four bytes.
    let some = &bytes[..bytes.len().min(4 * (MOST + 1))];
    clean(&String::from_utf8_lossy(some))
}

/// [`clean`] with another limit, for a text whose kind is longer: a printed line, a type's name.
pub fn clean_to(text: &str, most: usize) -> String {
    shown(text, most, colour)
}

/// Shows control characters as escapes. `removed` is the number of bytes that are left out at the
/// start of a text.
fn shown(text: &str, most: usize, removed: fn(&str) -> Option<usize>) -> String {
    let mut out = String::with_capacity(text.len().min(most));
    let mut count = 0;
    let mut rest = text;
    while let Some(c) = rest.chars().next() {
        if let Some(length) = removed(rest) {
            rest = &rest[length..];
            continue;
        }
        rest = &rest[c.len_utf8()..];
        let shown = if is_hidden(c) {
            c.escape_default().len()
        } else {
            1
        };
        if count + shown > most {
            out.push('…');
            break;
        }
        count += shown;
        if is_hidden(c) {
            out.extend(c.escape_default());
        } else {
            out.push(c);
        }
    }
    out
}

/// A text that is data, of at most `most` characters: nothing of it vanishes. Colours, too, are shown
/// as escapes.
///
/// ```
/// use rc_diagnostics::foreign::escape_to;
///
/// assert_eq!(escape_to("\u{1b}[31mred", 256), "\\u{1b}[31mred");
/// ```
pub fn escape_to(text: &str, most: usize) -> String {
    shown(text, most, |_| None)
}

/// [`clean_to`] for a text of several lines, such as a reason with the end of a log. Keeps the
/// lines.
pub fn clean_lines(text: &str, most: usize) -> String {
    let mut left = most;
    let mut lines = Vec::new();
    for line in text.split('\n') {
        let line = clean_to(line, left);
        let count = line.chars().count();
        lines.push(line);
        if count >= left {
            break;
        }
        // The end of a line counts, too.
        left -= count + 1;
    }
    lines.join("\n")
}

/// The length in bytes of a sequence that only sets colours (SGR of ECMA-48) at the start of
/// `text`.
fn colour(text: &str) -> Option<usize> {
    let parameters = text.strip_prefix("\u{1b}[")?;
    let end = parameters.find(|c: char| !c.is_ascii_digit() && c != ';')?;
    parameters[end..].starts_with('m').then_some(2 + end + 1)
}

/// Whether a terminal obeys the character rather than showing it. A tab does no harm.
pub fn is_hidden(c: char) -> bool {
    (c.is_control() && c != '\t')
        || matches!(
            c,
            '\u{ad}'
                | '\u{61c}'
                // Fillers of Hangul, which are letters without a picture.
                | '\u{115f}'..='\u{1160}'
                | '\u{3164}'
                | '\u{ffa0}'
                | '\u{180b}'..='\u{180f}'
                | '\u{200b}'..='\u{200f}'
                | '\u{2028}'..='\u{202e}'
                | '\u{2060}'..='\u{206f}'
                | '\u{2800}'
                | '\u{feff}'
                | '\u{fff9}'..='\u{fffb}'
                | '\u{e0000}'..='\u{e0fff}'
        )
}

/// A message of the system without its error number, which is useless to a reader: `No such file or
/// directory (os error 2)`.
pub fn without_number(text: &str) -> Cow<'_, str> {
    const BEFORE: &str = " (os error ";
    let mut rest = text;
    let mut out = String::new();
    while let Some((words, behind)) = rest.split_once(BEFORE) {
        out.push_str(words);
        let end = behind.trim_start_matches(|c: char| c.is_ascii_digit());
        let is_number = end.len() < behind.len() && end.starts_with(')');
        if is_number {
            rest = &end[1..];
        } else {
            out.push_str(BEFORE);
            rest = behind;
        }
    }
    if rest.len() == text.len() {
        return Cow::Borrowed(text);
    }
    out.push_str(rest);
    Cow::Owned(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_terminal_obeys_is_shown() {
        assert_eq!(
            clean("a\r\n\tb\u{7f}\u{9b}1m"),
            "a\\r\\n\tb\\u{7f}\\u{9b}1m"
        );
        assert_eq!(clean("\u{202e}drib\u{feff}"), r"\u{202e}drib\u{feff}");
        assert_eq!(clean("a\u{3164}\u{2800}b"), r"a\u{3164}\u{2800}b");
        assert_eq!(clean("größer, 大, C:\\x"), "größer, 大, C:\\x");
        assert_eq!(clean_bytes(b"a\xff\n"), "a\u{fffd}\\n");
    }

    #[test]
    fn a_long_text_is_cut_at_a_character_and_once() {
        let cut = clean(&"\n".repeat(20_000_000));
        assert_eq!(cut, format!("{}…", r"\n".repeat(MOST / 2)));
        for text in [&*cut, &"大".repeat(1000), &"x".repeat(MOST), "\u{1b}"] {
            let once = clean(text);
            assert!(once.chars().count() <= MOST + 1);
            assert_eq!(clean(&once), once);
        }
        let whole = "x".repeat(MOST);
        assert_eq!(clean(&whole), whole);
        assert_eq!(
            clean_bytes("大".repeat(1000).as_bytes()),
            clean(&"大".repeat(1000))
        );
    }

    #[test]
    fn messages_of_the_system_lose_their_numbers() {
        for (text, words) in [
            ("a: no such file (os error 2)", "a: no such file"),
            ("a (os error 2); b (os error 13)\n", "a; b\n"),
            ("a (os error x) (os error 2)", "a (os error x)"),
            ("a (os error )", "a (os error )"),
            ("a (os error 2", "a (os error 2"),
        ] {
            assert_eq!(without_number(text), words);
        }
    }

    #[test]
    fn lines_stay_lines() {
        assert_eq!(clean_lines("one\n\u{1b}two\n", 100), "one\n\\u{1b}two\n");
        assert_eq!(clean_lines("12345\n67890", 7), "12345\n6…");
        assert_eq!(clean_lines("12345\n67890", 5), "12345");
        let many = "x\n".repeat(1_000_000);
        assert!(clean_lines(&many, 100).chars().count() <= 101);
    }
}
