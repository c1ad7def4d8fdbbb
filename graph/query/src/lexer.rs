//! The words of a query.

use rc_diagnostics::{Diagnostic, SourceId, Span};

#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Token {
    /// A name or a keyword.
    Word(String),
    Text(String),
    Int(i64),
    Float(f64),
    /// A sign of one or more characters.
    Sign(&'static str),
    End,
}

/// Signs, longer ones first.
const SIGNS: [&str; 26] = [
    "<>", "<=", ">=", "..", "(", ")", "[", "]", "{", "}", ":", ",", ".", "|", "=", "<", ">", "+",
    "-", "*", "/", "%", "$", ";", "!", "&",
];

/// The tokens of a text, each with its range of bytes.
pub(crate) fn tokens(
    text: &str,
    source: SourceId,
) -> Result<Vec<(Token, usize, usize)>, Diagnostic> {
    let bytes = text.as_bytes();
    let mut all = Vec::new();
    let mut at = 0;
    while let Some(first) = text[at..].chars().next() {
        let start = at;
        let error = |end: usize, message: &str| {
            Diagnostic::error("query-syntax", Span::new(source, start, end), message)
        };
        if first.is_whitespace() {
            at += first.len_utf8();
            continue;
        }
        if text[at..].starts_with("//") {
            at += text[at..].find('\n').unwrap_or(text.len() - at);
            continue;
        }
        if first.is_alphabetic() || first == '_' {
            let rest = text[at..].find(|c: char| !(c.is_alphanumeric() || c == '_'));
            at += rest.unwrap_or(text.len() - at);
            all.push((Token::Word(text[start..at].to_owned()), start, at));
            continue;
        }
        if first == '`' {
            let Some(length) = text[at + 1..].find('`') else {
                return Err(error(at + 1, "a name in backticks does not end"));
            };
            at += length + 2;
            let name = text[start + 1..at - 1].to_owned();
            all.push((Token::Word(name), start, at));
            continue;
        }
        if first == '"' || first == '\'' {
            let mut value = String::new();
            let mut chars = text[at + 1..].char_indices();
            let end = loop {
                match chars.next() {
                    Some((offset, c)) if c == first => break Some(at + 1 + offset + 1),
                    Some((_, '\\')) => match chars.next() {
                        Some((_, 'n')) => value.push('\n'),
                        Some((_, 't')) => value.push('\t'),
                        Some((_, 'r')) => value.push('\r'),
                        Some((offset, sign @ ('u' | 'U'))) => {
                            let count = if sign == 'u' { 4 } else { 8 };
                            let Some(sign) = unicode(&mut chars, count) else {
                                let end = at + 1 + offset + sign.len_utf8();
                                let message =
                                    format!("expected {count} hexadecimal digits of a character");
                                return Err(error(end, &message));
                            };
                            value.push(sign);
                        }
                        Some((_, c)) => value.push(c),
                        None => break None,
                    },
                    Some((_, c)) => value.push(c),
                    None => break None,
                }
            };
            let Some(end) = end else {
                return Err(error(text.len(), "a string does not end"));
            };
            at = end;
            all.push((Token::Text(value), start, at));
            continue;
        }
        if first.is_ascii_digit() {
            let digits = |mut at: usize| {
                while bytes.get(at).is_some_and(u8::is_ascii_digit) {
                    at += 1;
                }
                at
            };
            at = digits(at);
            let mut is_float = false;
            // `1..3` is a range.
            if bytes.get(at) == Some(&b'.') && bytes.get(at + 1).is_some_and(u8::is_ascii_digit) {
                at = digits(at + 1);
                is_float = true;
            }
            if matches!(bytes.get(at), Some(b'e' | b'E')) {
                let sign = usize::from(matches!(bytes.get(at + 1), Some(b'+' | b'-')));
                if bytes.get(at + 1 + sign).is_some_and(u8::is_ascii_digit) {
                    at = digits(at + 1 + sign);
                    is_float = true;
                }
            }
            let word = &text[start..at];
            let token = if is_float {
                let number = word.parse().ok().filter(|number: &f64| number.is_finite());
                number.map(Token::Float)
            } else {
                word.parse().ok().map(Token::Int)
            };
            let Some(token) = token else {
                return Err(error(at, "the number is too large"));
            };
            all.push((token, start, at));
            continue;
        }
        let Some(sign) = SIGNS.iter().find(|sign| text[at..].starts_with(**sign)) else {
            return Err(error(at + first.len_utf8(), "unexpected character"));
        };
        at += sign.len();
        all.push((Token::Sign(sign), start, at));
    }
    all.push((Token::End, text.len(), text.len()));
    Ok(all)
}

/// The character that this many hexadecimal digits name.
fn unicode(chars: &mut std::str::CharIndices<'_>, count: usize) -> Option<char> {
    let digits = chars.by_ref().take(count);
    let number = digits.map(|(_, sign)| sign.to_digit(16));
    let number = number.collect::<Option<Vec<u32>>>()?;
    if number.len() < count {
        return None;
    }
    char::from_u32(number.iter().fold(0, |all, digit| (all << 4) | digit))
}
