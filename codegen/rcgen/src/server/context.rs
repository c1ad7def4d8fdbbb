//! The context of a cursor, also in a broken text: the blocks around it and the statement before it.

use rc_syntax::{Token, TokenKind, tokens};

/// A block around the cursor.
#[derive(Debug, Default)]
pub(super) struct Block<'a> {
    /// The statement before its `{`.
    pub(super) head: Vec<&'a str>,
    /// Its tokens before the cursor.
    pub(super) inside: Vec<&'a str>,
}

impl Block<'_> {
    /// The first word of its head, in lower case.
    pub(super) fn word(&self) -> String {
        self.head
            .first()
            .map_or_else(String::new, |word| word.to_ascii_lowercase())
    }
}

/// The context of a cursor.
#[derive(Debug, Default)]
pub(super) struct Context<'a> {
    /// The blocks around it, the outermost first. The first one is the file.
    pub(super) blocks: Vec<Block<'a>>,
    /// The tokens of its statement before it, without the word in which it is.
    pub(super) statement: Vec<&'a str>,
    /// The content of the string in which it is, as far as the cursor.
    pub(super) string: Option<&'a str>,
    /// Start of the word, or of the content of the string.
    pub(super) start: usize,
}

impl<'a> Context<'a> {
    /// The context of a byte of `text`. `None` in a comment.
    pub(super) fn at(text: &'a str, cursor: usize) -> Option<Self> {
        let mut context = Context {
            blocks: vec![Block::default()],
            start: cursor,
            ..Context::default()
        };
        for Token {
            kind,
            text: token,
            start,
            ..
        } in tokens(text)
        {
            let end = start + token.len();
            if start >= cursor {
                break;
            }
            match kind {
                TokenKind::Comment if is_within(text, token, start, cursor) => return None,
                TokenKind::Comment => {}
                TokenKind::String
                    if cursor < end
                        || !is_closed(token) && !text[end..cursor].contains(['\n', '\r']) =>
                {
                    context.start = start + 1;
                    context.string = text.get(start + 1..cursor);
                    break;
                }
                TokenKind::Word if cursor <= end => {
                    context.start = start;
                    break;
                }
                _ => context.take(token),
            }
        }
        Some(context)
    }

    fn take(&mut self, token: &'a str) {
        match token {
            "{" => {
                let head = std::mem::take(&mut self.statement);
                self.blocks.push(Block {
                    head,
                    inside: Vec::new(),
                });
                return;
            }
            "}" => {
                // A `}` too many ends nothing.
                if self.blocks.len() > 1 {
                    self.blocks.pop();
                }
                self.statement.clear();
                return;
            }
            ";" => self.statement.clear(),
            _ => self.statement.push(token),
        }
        if let Some(block) = self.blocks.last_mut() {
            block.inside.push(token);
        }
    }

    /// The first word of the statement, in lower case.
    pub(super) fn word(&self) -> String {
        self.statement
            .first()
            .map_or_else(String::new, |word| word.to_ascii_lowercase())
    }

    /// The token before the word of the cursor.
    pub(super) fn last(&self) -> &'a str {
        self.statement.last().copied().unwrap_or_default()
    }

    /// The groups of a network around the cursor, the outermost first.
    pub(super) fn groups(&self) -> Vec<&'a str> {
        let blocks = self.blocks.iter().skip(1);
        let groups = blocks.filter(|block| block.word() == "group");
        groups
            .filter_map(|block| block.head.get(1).copied())
            .collect()
    }

    /// The first words of the blocks around the cursor, in lower case, the outermost first.
    pub(super) fn around(&self) -> Vec<String> {
        self.blocks.iter().skip(1).map(Block::word).collect()
    }
}

/// Whether the cursor is in a comment: one of a line reaches to the end of the line.
fn is_within(text: &str, comment: &str, start: usize, cursor: usize) -> bool {
    let end = start + comment.len();
    let behind = text.get(end..cursor);
    let line = |behind: &str| comment.starts_with("//") && !behind.contains(['\n', '\r']);
    behind.is_none_or(line)
}

/// Whether a token of a string has its second quote.
fn is_closed(token: &str) -> bool {
    let Some(inner) = token.strip_suffix('"').filter(|inner| !inner.is_empty()) else {
        return false;
    };
    let escapes = inner.bytes().rev().take_while(|byte| *byte == b'\\');
    escapes.count() % 2 == 0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shown(text: &str) -> String {
        let cursor = text.find('|').expect("a cursor");
        let text = text.replace('|', "");
        match Context::at(&text, cursor) {
            None => "comment".to_owned(),
            Some(at) => format!(
                "{} > {}{} +{}",
                at.around().join("/"),
                at.statement.join(" "),
                at.string
                    .map_or_else(String::new, |string| format!(" {string:?}")),
                &text[at.start..cursor]
            ),
        }
    }

    #[test]
    fn the_blocks_and_the_statement_before_a_cursor_are_found_in_broken_texts() {
        for (text, expected) in [
            ("|", " >  +"),
            (
                "Component a { Communications { implements La|",
                "component/communications > implements +La",
            ),
            ("a { b; c { }; d e, |", "a > d e , +"),
            ("import \"La|", " > import \"La\" +La"),
            ("a { cdsl \"x/|y\"; }", "a > cdsl \"x/\" +x/"),
            ("} } a { |", "a >  +"),
            ("a { // b |", "comment"),
            ("a { /* b| */", "comment"),
            ("// b\n|a", " >  +"),
            ("a { /* b */ c|", "a >  +c"),
            ("bind a.|", " > bind a . +"),
            // A string ends with its line.
            ("import \"La\nlanguage |", " > import \"La language +"),
            (r#"a { b "c\\" d |"#, r#"a > b "c\\" d +"#),
        ] {
            assert_eq!(shown(text), expected, "{text}");
        }
    }
}
