//! Formats a text: one element a line, indented; one space between attributes. Comments, entities
//! and quotes stay as they are, and so does the order of everything.

/// A piece of an XML text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Token<'a> {
    /// `<?…?>`, `<!--…-->` or `<![CDATA[…]]>`.
    Verbatim(&'a str),
    /// `<name …>`, without the brackets.
    Start(&'a str),
    /// `<name …/>`, without the brackets and the slash.
    Empty(&'a str),
    /// `</name>`, without the brackets and the slash.
    End(&'a str),
    /// Text between elements.
    Text(&'a str),
}

/// Lays out a well-formed text.
pub fn format(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut depth = 0_usize;
    // Line feeds since the last token. There are none before the first one.
    let mut feeds = 0;
    let mut opened = false;
    for token in tokens(text) {
        if let Token::Text(words) = token
            && words.trim().is_empty()
        {
            feeds += words.matches('\n').count();
            continue;
        }
        let ends = matches!(token, Token::End(_));
        depth -= usize::from(ends && depth > 0);
        // An element without content stays on its line, and so does a comment after code.
        let same_line = ends && opened && feeds == 0 && out.ends_with('>')
            || feeds == 0 && matches!(token, Token::Verbatim(t) if t.starts_with("<!--"));
        if !out.is_empty() && same_line && !ends {
            out.push(' ');
        } else if !out.is_empty() && !same_line {
            out.push_str(if feeds > 1 && !ends && !opened {
                "\n\n"
            } else {
                "\n"
            });
            (0..depth).for_each(|_| out.push_str("    "));
        }
        feeds = 0;
        opened = false;
        match token {
            Token::Verbatim(text) => out.push_str(text),
            Token::Text(text) => {
                out.push_str(text.trim());
                feeds = text[text.trim_end().len()..].matches('\n').count();
            }
            Token::Start(inside) => {
                tag(&mut out, inside, ">");
                depth += 1;
                opened = true;
            }
            Token::Empty(inside) => tag(&mut out, inside, "/>"),
            Token::End(name) => {
                out.push_str("</");
                out.push_str(name.trim());
                out.push('>');
            }
        }
    }
    if !out.is_empty() {
        out.push('\n');
    }
    out
}

/// Writes a tag with one space before each attribute.
fn tag(out: &mut String, inside: &str, end: &str) {
    out.push('<');
    let mut quote = None;
    let mut space = false;
    for c in inside.trim().chars() {
        match quote {
            Some(open) => {
                out.push(c);
                if c == open {
                    quote = None;
                    // XML needs a space here; a text without one is not well-formed.
                    space = true;
                }
            }
            None if c.is_whitespace() => space = true,
            None => {
                let after_equals = out.ends_with('=');
                if space && c != '=' && !after_equals {
                    out.push(' ');
                }
                space = false;
                if c == '"' || c == '\'' {
                    quote = Some(c);
                }
                out.push(c);
            }
        }
    }
    out.push_str(end);
}

fn tokens(text: &str) -> Vec<Token<'_>> {
    let mut tokens = Vec::new();
    let mut rest = text;
    while !rest.is_empty() {
        let verbatim = [("<?", "?>"), ("<!--", "-->"), ("<![CDATA[", "]]>")];
        let found = verbatim.iter().find(|(open, _)| rest.starts_with(open));
        let length = if let Some((open, close)) = found {
            let end = rest[open.len()..].find(close);
            let length = end.map_or(rest.len(), |end| open.len() + end + close.len());
            tokens.push(Token::Verbatim(&rest[..length]));
            length
        } else if rest.starts_with('<') {
            let end = tag_end(rest);
            let inside = &rest[1..end];
            tokens.push(match (inside.strip_prefix('/'), inside.strip_suffix('/')) {
                (Some(name), _) => Token::End(name),
                (None, Some(inside)) => Token::Empty(inside),
                (None, None) => Token::Start(inside),
            });
            (end + 1).min(rest.len())
        } else {
            let length = rest.find('<').unwrap_or(rest.len());
            tokens.push(Token::Text(&rest[..length]));
            length
        };
        rest = &rest[length..];
    }
    tokens
}

/// The place of the `>` that ends the tag at the start of `text`.
fn tag_end(text: &str) -> usize {
    let mut quote = None;
    for (at, c) in text.char_indices() {
        match quote {
            Some(open) if c == open => quote = None,
            None if c == '"' || c == '\'' => quote = Some(c),
            None if c == '>' => return at,
            Some(_) | None => {}
        }
    }
    text.len()
}

/// Whether the outermost element of a text is `innerModel`: a folder may have other XML files.
pub fn is_innermodel(text: &str) -> bool {
    let text = text.trim_start_matches('\u{feff}');
    let root = tokens(text).into_iter().find_map(|token| match token {
        Token::Start(inside) | Token::Empty(inside) => Some(inside),
        _ => None,
    });
    let name = root.and_then(|inside| inside.split_whitespace().next());
    name.is_some_and(|name| name.eq_ignore_ascii_case(crate::elements::ROOT))
}
