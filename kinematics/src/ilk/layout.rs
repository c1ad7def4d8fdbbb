//! The layout of models in ILK. Comments stay, and so do single empty lines between entries.

/// The widest line that holds a whole table.
const WIDTH: usize = 100;

/// A word, a text in quotes, a sign or a comment.
struct Token<'t> {
    text: &'t str,
    /// The line breaks before it.
    breaks: usize,
}

/// The tokens of a text that [`read`](super::lua::read) reads.
fn tokens(text: &str) -> Vec<Token<'_>> {
    let mut tokens = Vec::new();
    let mut at = 0;
    loop {
        let rest = &text[at..];
        let token = rest.trim_start();
        let Some(first) = token.chars().next() else {
            return tokens;
        };
        let blank = rest.len() - token.len();
        let breaks = rest[..blank].matches('\n').count();
        let length = match first {
            '{' | '}' | '[' | ']' | '=' | ',' | ';' => 1,
            '\'' | '"' => token[1..]
                .find(first)
                .map_or(token.len(), |length| length + 2),
            _ if token.starts_with("--[[") => {
                token.find("]]").map_or(token.len(), |length| length + 2)
            }
            _ if token.starts_with("--") => token.find('\n').unwrap_or(token.len()),
            _ => {
                let is_end = |c: char| c.is_whitespace() || "{}[]=,;'\"".contains(c);
                let end = token.find(is_end).unwrap_or(token.len());
                token[..end].find("--").unwrap_or(end)
            }
        };
        let text = token[..length].trim_end();
        tokens.push(Token { text, breaks });
        at += blank + length;
    }
}

fn is_comment(text: &str) -> bool {
    text.starts_with("--")
}

/// `NAME = VALUE`, with the comments at it.
#[derive(Default)]
struct Entry<'t> {
    /// Whether an empty line is before it.
    is_apart: bool,
    before: Vec<&'t str>,
    name: String,
    value: Value<'t>,
    behind: Option<&'t str>,
}

#[derive(Default)]
enum Value<'t> {
    #[default]
    Nothing,
    Word(&'t str),
    Table {
        entries: Vec<Entry<'t>>,
        /// The comments behind the last entry.
        end: Vec<&'t str>,
    },
}

struct Layout<'t> {
    tokens: Vec<Token<'t>>,
    at: usize,
}

impl<'t> Layout<'t> {
    fn next(&self) -> Option<&Token<'t>> {
        self.tokens.get(self.at)
    }

    /// The entries up to the end of a table.
    fn table(&mut self) -> Value<'t> {
        let (mut entries, mut entry) = (Vec::new(), Entry::default());
        let mut is_first = true;
        while let Some(Token { text, breaks }) = self.next() {
            let (text, breaks) = (*text, *breaks);
            self.at += 1;
            let is_begun = !entry.name.is_empty() || !matches!(entry.value, Value::Nothing);
            if is_first {
                entry.is_apart = breaks > 1;
                is_first = false;
            }
            match text {
                "}" => break,
                "," | ";" => {
                    entry.behind = entry.behind.take().or_else(|| self.behind());
                    entries.push(std::mem::take(&mut entry));
                    is_first = true;
                }
                "{" => entry.value = self.table(),
                "[" => "[".clone_into(&mut entry.name),
                "]" => entry.name.push(']'),
                // The word before it is a name.
                "=" => {
                    if let Value::Word(word) = std::mem::take(&mut entry.value) {
                        word.clone_into(&mut entry.name);
                    }
                }
                _ if is_comment(text) && is_begun && breaks == 0 && entry.behind.is_none() => {
                    entry.behind = Some(text);
                }
                _ if is_comment(text) => entry.before.push(text),
                _ if entry.name == "[" => entry.name.push_str(text),
                _ => entry.value = Value::Word(text),
            }
        }
        if matches!(entry.value, Value::Nothing) {
            let end = entry.before;
            return Value::Table { entries, end };
        }
        entries.push(entry);
        Value::Table {
            entries,
            end: Vec::new(),
        }
    }

    /// A comment on the line of the token before it.
    fn behind(&mut self) -> Option<&'t str> {
        let Token { text, breaks } = self.next()?;
        let (text, is_here) = (*text, *breaks == 0);
        (is_here && is_comment(text)).then(|| {
            self.at += 1;
            text
        })
    }
}

impl Value<'_> {
    /// The value on one line, if it has no comment.
    fn flat(&self) -> Option<String> {
        match self {
            Self::Nothing => Some(String::new()),
            Self::Word(word) => Some((*word).to_owned()),
            Self::Table { entries, end } if entries.is_empty() && end.is_empty() => {
                Some("{}".to_owned())
            }
            Self::Table { entries, end } => {
                let mut parts = Vec::new();
                for entry in entries {
                    if !entry.before.is_empty() || entry.behind.is_some() {
                        return None;
                    }
                    parts.push(named(&entry.name, &entry.value.flat()?));
                }
                end.is_empty()
                    .then(|| format!("{{ {} }}", parts.join(", ")))
            }
        }
    }
}

fn named(name: &str, value: &str) -> String {
    if name.is_empty() {
        value.to_owned()
    } else {
        format!("{name} = {value}")
    }
}

fn lines(out: &mut String, depth: usize, text: &str) {
    out.push_str(&"    ".repeat(depth));
    out.push_str(text);
    out.push('\n');
}

fn print(out: &mut String, depth: usize, begin: &str, value: &Value<'_>, close: &str) {
    if let Some(flat) = value.flat() {
        let line = format!("{begin}{flat}{close}");
        let is_word = !matches!(value, Value::Table { .. });
        if is_word || 4 * depth + line.chars().count() <= WIDTH {
            lines(out, depth, &line);
            return;
        }
    }
    let Value::Table { entries, end } = value else {
        return;
    };
    lines(out, depth, &format!("{begin}{{"));
    for (at, entry) in entries.iter().enumerate() {
        if entry.is_apart && at > 0 {
            out.push('\n');
        }
        for comment in &entry.before {
            lines(out, depth + 1, comment);
        }
        let behind = entry
            .behind
            .map_or(",".to_owned(), |text| format!(", {text}"));
        print(
            out,
            depth + 1,
            &named(&entry.name, ""),
            &entry.value,
            &behind,
        );
    }
    for comment in end {
        lines(out, depth + 1, comment);
    }
    lines(out, depth, &format!("}}{close}"));
}

/// A text that [`read`](super::lua::read) reads, laid out.
pub(super) fn layout(text: &str) -> String {
    let mut layout = Layout {
        tokens: tokens(text),
        at: 0,
    };
    let mut out = String::new();
    let mut comments = |layout: &mut Layout<'_>| {
        while let Some(Token { text, .. }) = layout.next() {
            // The comment of the word `return` goes above it.
            if !is_comment(text) && *text != "return" && *text != ";" {
                break;
            }
            if is_comment(text) {
                lines(&mut out, 0, text);
            }
            layout.at += 1;
        }
    };
    comments(&mut layout);
    layout.at += 1;
    let table = layout.table();
    let mut rest = layout;
    let mut body = String::new();
    print(&mut body, 0, "return ", &table, "");
    out.push_str(&body);
    let mut after = String::new();
    while let Some(Token { text, .. }) = rest.next() {
        if is_comment(text) {
            lines(&mut after, 0, text);
        }
        rest.at += 1;
    }
    out + &after
}
