//! The edit that imports a file.

use crate::{Token, TokenKind, tokens};

/// The edit that imports a file: after the last import and a comment of its line, or before the
/// component and the comments that are about it.
pub fn import_edit(text: &str, file: &str) -> (usize, String) {
    let tokens = tokens(text);
    let first = tokens
        .iter()
        .position(|token| token.kind != TokenKind::Comment)
        .unwrap_or(tokens.len());
    let mut at = tokens.get(first).map_or(text.len(), |token| token.start);
    for comment in tokens[..first].iter().rev() {
        let between = &text[comment.start + comment.text.len()..at];
        // After a blank line, a comment is about the file.
        if between.replace("\r\n", "\n").matches(['\n', '\r']).count() > 1 {
            break;
        }
        at = comment.start;
    }
    let mut new = format!("import \"{file}\";\n\n");
    for (number, three) in tokens.windows(3).enumerate() {
        if three[0].text.eq_ignore_ascii_case("import") && three[2].text == ";" {
            at = three[2].start + 1;
            let next = tokens.get(number + 3);
            let next = next.filter(|next| next.kind == TokenKind::Comment);
            let same_line = |next: &&Token<'_>| !text[at..next.start].contains(['\n', '\r']);
            if let Some(comment) = next.filter(same_line) {
                at = comment.start + comment.text.len();
            }
            new = format!("\nimport \"{file}\";");
        }
    }
    (at, new)
}

#[cfg(test)]
mod tests {
    use super::import_edit;

    #[test]
    fn an_import_separates_no_comment_from_what_it_is_about() {
        for (text, expected) in [
            ("Component a {}", "import \"x\";\n\nComponent a {}"),
            (
                "/// About a.\nComponent a {}",
                "import \"x\";\n\n/// About a.\nComponent a {}",
            ),
            (
                "// License.\n\n/** a\n */\n/// b\nComponent a {}",
                "// License.\n\nimport \"x\";\n\n/** a\n */\n/// b\nComponent a {}",
            ),
            (
                "import \"y\"; // why\n/// a\nComponent a {}",
                "import \"y\"; // why\nimport \"x\";\n/// a\nComponent a {}",
            ),
            (
                "// Nothing.\r\n\r\n",
                "// Nothing.\r\n\r\nimport \"x\";\n\n",
            ),
            ("", "import \"x\";\n\n"),
        ] {
            let (at, new) = import_edit(text, "x");
            assert_eq!(format!("{}{new}{}", &text[..at], &text[at..]), expected);
        }
    }
}
