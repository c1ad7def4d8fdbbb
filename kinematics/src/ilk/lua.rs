//! The part of Lua that models in ILK are written in: one table of texts, numbers and tables.

use rc_diagnostics::{Diagnostic, Diagnostics, Name, SourceId, Span};
use std::collections::HashMap;

/// The deepest nesting of tables.
const DEEPEST: usize = 16;

/// A value with its place.
#[derive(Clone, Debug)]
pub(super) struct Value {
    pub(super) span: Span,
    pub(super) kind: Kind,
}

#[derive(Clone, Debug)]
pub(super) enum Kind {
    Text(String),
    Number(f64),
    /// `true`, `false` and `nil`, which no model needs.
    Word,
    Table(Table),
}

/// `{ NAME = VALUE, VALUE }`
#[derive(Clone, Debug, Default)]
pub(super) struct Table {
    pub(super) fields: Vec<(Name, Value)>,
    pub(super) items: Vec<Value>,
    /// The places of the fields.
    places: HashMap<String, usize>,
}

impl Table {
    pub(super) fn get(&self, name: &str) -> Option<&Value> {
        self.places.get(name).map(|at| &self.fields[*at].1)
    }
}

struct Reader<'t> {
    text: &'t str,
    source: SourceId,
    at: usize,
    found: Diagnostics,
}

/// Reads `return { … }`. `None` after a finding.
pub(super) fn read(text: &str, source: SourceId) -> (Option<Value>, Diagnostics) {
    let mut reader = Reader {
        text,
        source,
        at: 0,
        found: Diagnostics::new(),
    };
    let value = reader.file();
    (value, reader.found)
}

/// Reads `return { … }` as a table. `None` after a finding.
pub(super) fn table(text: &str, source: SourceId) -> (Option<Table>, Diagnostics) {
    let (value, mut found) = read(text, source);
    match value.map(|value| value.kind) {
        Some(Kind::Table(table)) => (Some(table), found),
        None => (None, found),
        Some(_) => {
            let message = "expected a table after `return`";
            let whole = Span::new(source, 0, 0);
            found.push(Diagnostic::error("syntax-error", whole, message));
            (None, found)
        }
    }
}

fn is_word(c: char) -> bool {
    c.is_ascii_alphanumeric() || c == '_'
}

impl Reader<'_> {
    fn rest(&self) -> &str {
        &self.text[self.at..]
    }

    fn span(&self, start: usize) -> Span {
        Span::new(self.source, start, self.at)
    }

    /// Goes on to the next character that is no space and no comment.
    fn skip(&mut self) {
        loop {
            let rest = self.rest();
            let spaces = rest.len() - rest.trim_start().len();
            self.at += spaces;
            let Some(comment) = self.rest().strip_prefix("--") else {
                return;
            };
            let end = if comment.starts_with("[[") {
                "]]"
            } else {
                "\n"
            };
            let length = comment.find(end).map_or(comment.len(), |at| at + end.len());
            self.at += 2 + length;
        }
    }

    fn expected(&mut self, what: &str) {
        let next = self.rest().chars().next();
        let start = self.at;
        let found = next.map_or("the end of the file".to_owned(), |c| format!("`{c}`"));
        let end = start + next.map_or(0, char::len_utf8);
        let span = Span::new(self.source, start, end);
        let message = format!("expected {what}, found {found}");
        self.found
            .push(Diagnostic::error("syntax-error", span, message));
    }

    fn takes(&mut self, sign: &str) -> bool {
        self.skip();
        let is_next = self.rest().starts_with(sign);
        if is_next {
            self.at += sign.len();
        }
        is_next
    }

    fn word(&mut self) -> Option<Name> {
        self.skip();
        let rest = self.rest();
        let length = rest.find(|c| !is_word(c)).unwrap_or(rest.len());
        let is_name = rest.starts_with(|c: char| is_word(c) && !c.is_ascii_digit());
        if length == 0 || !is_name {
            return None;
        }
        let (start, text) = (self.at, rest[..length].to_owned());
        self.at += length;
        Some(Name::new(text, self.span(start)))
    }

    fn file(&mut self) -> Option<Value> {
        let begin = self.at;
        match self.word() {
            Some(word) if word.text == "return" => {}
            _ => {
                self.at = begin;
                self.skip();
                self.expected("`return { … }`");
                return None;
            }
        }
        let value = self.value(0)?;
        self.takes(";");
        self.skip();
        if !self.rest().is_empty() {
            self.expected("the end of the file");
            return None;
        }
        Some(value)
    }

    fn value(&mut self, depth: usize) -> Option<Value> {
        self.skip();
        let start = self.at;
        let first = self.rest().chars().next();
        let kind = match first {
            Some('{') if depth < DEEPEST => {
                self.at += 1;
                Kind::Table(self.table(depth + 1)?)
            }
            Some(quote @ ('\'' | '"')) => Kind::Text(self.quoted(quote)?),
            Some('-' | '+' | '.' | '0'..='9') => Kind::Number(self.number()?),
            Some(c) if is_word(c) => {
                let word = self.word()?;
                if !["true", "false", "nil"].contains(&word.text.as_str()) {
                    self.at = start;
                    self.expected("a text, a number or a table: models compute nothing");
                    return None;
                }
                Kind::Word
            }
            _ => {
                self.expected("a text, a number or a table");
                return None;
            }
        };
        let span = self.span(start);
        Some(Value { span, kind })
    }

    fn quoted(&mut self, quote: char) -> Option<String> {
        let start = self.at;
        self.at += 1;
        let rest = self.rest();
        let end = rest.find([quote, '\n', '\\']);
        match end {
            Some(end) if rest[end..].starts_with(quote) => {
                let text = rest[..end].to_owned();
                self.at += end + 1;
                Some(text)
            }
            _ => {
                self.at = start;
                self.expected("a text in quotes on one line, without `\\`");
                None
            }
        }
    }

    fn number(&mut self) -> Option<f64> {
        let rest = self.rest();
        let signs = |c: char| c.is_ascii_alphanumeric() || ['.', '-', '+'].contains(&c);
        let mut length = rest.find(|c| !signs(c)).unwrap_or(rest.len());
        // A sign in the middle belongs to an exponent.
        let inside = rest[..length]
            .char_indices()
            .skip(1)
            .find(|(at, c)| ['-', '+'].contains(c) && !rest[..*at].ends_with(['e', 'E']));
        if let Some((at, _)) = inside {
            length = at;
        }
        let value: Option<f64> = rest[..length].parse().ok().filter(|v: &f64| v.is_finite());
        if value.is_none() {
            self.expected("a finite number");
        }
        self.at += length;
        value
    }

    fn table(&mut self, depth: usize) -> Option<Table> {
        let mut table = Table::default();
        loop {
            if self.takes("}") {
                return Some(table);
            }
            let begin = self.at;
            let name = if self.takes("[") {
                let name = self.value(depth)?;
                let Kind::Text(text) = name.kind else {
                    self.at = begin;
                    self.expected("a name");
                    return None;
                };
                if !self.takes("]") {
                    self.expected("`]`");
                    return None;
                }
                Some(Name::new(text, name.span))
            } else {
                self.word()
            };
            match name {
                Some(name) if self.takes("=") => {
                    let value = self.value(depth)?;
                    let place = table.fields.len();
                    if let Some(first) = table.places.insert(name.text.clone(), place) {
                        let first = &table.fields[first].0;
                        let message = format!("`{}` occurs twice", name.text);
                        let error = Diagnostic::error("duplicate-name", name.span, message);
                        self.found.push(error.label(first.span, "first here"));
                        return None;
                    }
                    table.fields.push((name, value));
                }
                _ => {
                    self.at = begin;
                    table.items.push(self.value(depth)?);
                }
            }
            if !self.takes(",") && !self.takes(";") {
                if self.takes("}") {
                    return Some(table);
                }
                self.expected("`,` or `}`");
                return None;
            }
        }
    }
}
