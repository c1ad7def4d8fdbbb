//! Texts in a picture: their widths without a font, as in `DejaVu Sans`, which is wider than most
//! fonts, line breaks, and XML.

/// The width of a text of this size, rounded up.
pub fn width(text: &str, size: f64, bold: bool) -> i32 {
    let thousandths: u32 = text.chars().map(thousandths).sum();
    let width = f64::from(thousandths) / 1000.0 * size * if bold { 1.12 } else { 1.0 };
    width.ceil() as i32
}

fn thousandths(c: char) -> u32 {
    match c {
        'i' | 'j' | 'l' | '\'' | '|' => 340,
        ' ' | ',' | '.' | ':' | ';' | '/' | '\\' | 'f' | 't' | 'r' | '(' | ')' | '[' | ']'
        | '!' | 'I' | 'J' | '-' | '`' => 412,
        'm' | 'M' | 'W' | '@' | '%' => 1000,
        'w' | 'N' | 'O' | 'Q' | 'G' | 'D' | 'H' | 'U' | '&' | '#' | '+' | '=' | '<' | '>' => 838,
        'A'..='Z' => 720,
        ' '..='~' => 640,
        // Other narrow alphabets. The remaining characters may be as wide as high, or twice as
        // wide.
        '\u{a0}'..='\u{10ff}' => 800,
        _ => 1300,
    }
}

/// Wraps a text at this width, between words, or within a word that is too wide.
pub fn wrap(text: &str, size: f64, limit: i32) -> Vec<String> {
    let fits = |text: &str| width(text, size, false) <= limit;
    let (mut lines, mut line) = (Vec::new(), String::new());
    for word in text.split_whitespace() {
        let space = if line.is_empty() { "" } else { " " };
        if fits(&format!("{line}{space}{word}")) {
            line = line + space + word;
            continue;
        }
        if !line.is_empty() {
            lines.push(std::mem::take(&mut line));
        }
        for c in word.chars() {
            if !line.is_empty() && !fits(&format!("{line}{c}")) {
                lines.push(std::mem::take(&mut line));
            }
            line.push(c);
        }
    }
    lines.push(line);
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_text_is_broken_to_fit() {
        let lines = wrap("one two abcdefghijklmnopqrstuvwxyz three", 10.0, 60);
        assert!(
            lines.iter().all(|l| width(l, 10.0, false) <= 60),
            "{lines:?}"
        );
        assert_eq!(lines.concat().replace(' ', "").len(), 37);
        assert_eq!(wrap("", 10.0, 60), [""]);
    }
}
