//! Texts in XML and HTML.

/// Escapes a text for a place between tags, or for a value in quotes. Tabulators and ends of lines are
/// references, so that readers keep them in values. Characters that XML 1.0 does not allow become
/// `�`.
pub fn escaped(text: &str) -> String {
    let is_forbidden = |c| {
        matches!(c, '\0'..='\u{1f}' | '\u{fffe}' | '\u{ffff}') && !matches!(c, '\t' | '\n' | '\r')
    };
    unchecked(&text.replace(is_forbidden, "\u{fffd}"))
}

/// [`escaped`] with the characters that XML does not allow: for elements that are checked afterwards.
pub fn unchecked(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            '\t' => out.push_str("&#9;"),
            '\n' => out.push_str("&#10;"),
            '\r' => out.push_str("&#13;"),
            other => out.push(other),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn characters_that_xml_forbids_are_replaced() {
        assert_eq!(
            escaped("a<b>&\"'\u{1}\n"),
            "a&lt;b&gt;&amp;&quot;&#39;\u{fffd}&#10;"
        );
        assert_eq!(unchecked("<\u{1}"), "&lt;\u{1}");
    }
}
