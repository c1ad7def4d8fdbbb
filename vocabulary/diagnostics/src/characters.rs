//! Characters that no language expects, and that are invisible or easily mistaken for others.

use crate::{Diagnostic, Span};

/// The error about a character at `span` that is invisible or easily mistaken for another one. None
/// for letters, digits and signs.
pub fn stray_character(c: char, span: Span) -> Option<Diagnostic> {
    if matches!(c, ' '..='~' | '\t' | '\n' | '\r') {
        return None;
    }
    let error = |name: &str| {
        let message = format!("unexpected character U+{:04X} ({name})", u32::from(c));
        Diagnostic::error("stray-character", span, message)
    };
    if let Some((name, meant)) = mistaken(c) {
        let error = error(name).help(format!("write `{meant}`"));
        return Some(error.fix(c, meant));
    }
    let error = error(hidden(c)?).help("delete it, or write a space");
    Some(if c.is_whitespace() {
        error.fix(c, " ")
    } else {
        error
    })
}

/// Characters that look like those of the languages: their names, and what their writer means.
fn mistaken(c: char) -> Option<(&'static str, char)> {
    Some(match c {
        '\u{201c}' | '\u{201d}' | '\u{201e}' | '\u{201f}' | '\u{2033}' | '«' | '»' | '\u{2018}'
        | '\u{2019}' | '\u{201a}' | '\u{201b}' | '\u{2032}' | '\u{ff02}' => {
            ("a typographic quote", '"')
        }
        '\u{2010}'..='\u{2015}' | '\u{2212}' | '\u{fe63}' | '\u{ff0d}' => ("a dash", '-'),
        '\u{37e}' | '\u{ff1b}' => ("a foreign semicolon", ';'),
        '\u{ff0c}' => ("a foreign comma", ','),
        '\u{ff1a}' => ("a foreign colon", ':'),
        '\u{ff08}' => ("a foreign bracket", '('),
        '\u{ff09}' => ("a foreign bracket", ')'),
        '\u{ff5b}' => ("a foreign bracket", '{'),
        '\u{ff5d}' => ("a foreign bracket", '}'),
        _ => return None,
    })
}

/// The name of an invisible character.
fn hidden(c: char) -> Option<&'static str> {
    Some(match c {
        '\0' => "a null character",
        '\u{b}' => "a vertical tab",
        '\u{c}' => "a form feed",
        '\u{85}' | '\u{2028}' => "a line separator",
        '\u{2029}' => "a paragraph separator",
        '\u{a0}' | '\u{2007}' | '\u{202f}' => "a no-break space",
        '\u{ad}' => "a soft hyphen",
        '\u{200b}' => "a zero-width space",
        '\u{200c}' | '\u{200d}' | '\u{2060}' => "a zero-width joiner",
        '\u{feff}' => "a byte order mark",
        _ if c.is_whitespace() => "a foreign space",
        _ if crate::foreign::is_hidden(c) => "an invisible character",
        _ => return None,
    })
}
