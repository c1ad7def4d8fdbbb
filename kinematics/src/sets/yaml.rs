//! The part of YAML that sets are written in: blocks of names and lists, and words, on lines of
//! their own.

use rc_diagnostics::{Diagnostic, Diagnostics, Name, SourceId, Span};
use std::collections::HashMap;

/// The deepest nesting of blocks.
const DEEPEST: usize = 16;

/// A value with its place.
#[derive(Clone, Debug)]
pub(super) struct Value {
    pub(super) span: Span,
    pub(super) kind: Kind,
}

#[derive(Clone, Debug)]
pub(super) enum Kind {
    /// `NAME:` without a value.
    Nothing,
    Word(String),
    List(Vec<Value>),
    Fields(Vec<(Name, Value)>),
}

/// A line without its indentation and its comment.
struct Line<'t> {
    indent: usize,
    start: usize,
    text: &'t str,
}

struct Reader<'t> {
    source: SourceId,
    lines: Vec<Line<'t>>,
    at: usize,
    found: Diagnostics,
}

/// Reads a text. `None` after a finding.
pub(super) fn read(text: &str, source: SourceId) -> (Option<Value>, Diagnostics) {
    let mut reader = Reader {
        source,
        lines: Vec::new(),
        at: 0,
        found: Diagnostics::new(),
    };
    reader.lines(text);
    let mut value = None;
    if !reader.found.has_errors() {
        value = match reader.lines.first() {
            Some(first) => {
                let indent = first.indent;
                reader.block(indent, 0)
            }
            None => reader.wrong((0, 0), "expected `NAME: VALUE`, found an empty file"),
        };
    }
    if let Some(rest) = reader.lines.get(reader.at)
        && !reader.found.has_errors()
    {
        let place = (rest.start, rest.text.len());
        value = reader.wrong(place, "this line is indented unlike the ones before it");
    }
    (value, reader.found)
}

/// The text before a comment.
fn uncommented(line: &str) -> &str {
    let mut quote = None;
    let mut before = ' ';
    for (at, c) in line.char_indices() {
        match quote {
            Some(open) if c == open => quote = None,
            None if c == '\'' || c == '"' => quote = Some(c),
            None if c == '#' && before.is_whitespace() => return &line[..at],
            _ => {}
        }
        before = c;
    }
    line
}

/// The name and the value of `NAME: VALUE`.
fn field(text: &str) -> Option<(&str, &str)> {
    let colon = text.match_indices(':').map(|(at, _)| at).find(|at| {
        let rest = &text[at + 1..];
        rest.is_empty() || rest.starts_with(' ')
    })?;
    Some((text[..colon].trim_end(), &text[colon + 1..]))
}

impl<'t> Reader<'t> {
    fn wrong(&mut self, (start, length): (usize, usize), message: &str) -> Option<Value> {
        let span = Span::new(self.source, start, start + length);
        let error = Diagnostic::error("syntax-error", span, message.to_owned());
        self.found.push(error);
        None
    }

    fn lines(&mut self, text: &'t str) {
        let mut start = 0;
        for line in text.split_inclusive('\n') {
            let content = uncommented(line).trim_end();
            let own = content.trim_start_matches(' ');
            let indent = content.len() - own.len();
            let at = start + indent;
            start += line.len();
            if own.is_empty() || own == "---" {
                continue;
            }
            if own.starts_with('\t') {
                self.wrong((at, 1), "a line is indented by spaces");
                return;
            }
            self.lines.push(Line {
                indent,
                start: at,
                text: own,
            });
        }
    }

    /// The lines with this indentation, and deeper ones.
    fn block(&mut self, indent: usize, depth: usize) -> Option<Value> {
        let (start, text) = {
            let line = self.lines.get(self.at)?;
            (line.start, line.text)
        };
        if depth > DEEPEST {
            return self.wrong((start, text.len()), "blocks are nested too deep");
        }
        let is_list = |text: &str| text == "-" || text.starts_with("- ");
        let kind = if is_list(text) {
            let mut items = Vec::new();
            while let Some(line) = self.lines.get_mut(self.at)
                && line.indent == indent
                && is_list(line.text)
            {
                let rest = line.text[1..].trim_start();
                if rest.is_empty() {
                    let place = (line.start, 1);
                    self.at += 1;
                    items.push(match self.deeper(indent) {
                        Some(own) => self.block(own, depth + 1)?,
                        None => return self.wrong(place, "expected a value after `-`"),
                    });
                    continue;
                }
                // The item is a block that begins on the line of its sign.
                let skipped = line.text.len() - rest.len();
                line.text = rest;
                line.indent += skipped;
                line.start += skipped;
                let own = line.indent;
                items.push(self.block(own, depth + 1)?);
            }
            Kind::List(items)
        } else if field(text).is_some() {
            Kind::Fields(self.fields(indent, depth)?)
        } else {
            self.at += 1;
            return self.word(start, text);
        };
        let end = self.lines[..self.at].last();
        let end = end.map_or(start, |line| line.start + line.text.len());
        Some(Value {
            span: Span::new(self.source, start, end.max(start)),
            kind,
        })
    }

    /// The indentation of the next line, if it is deeper.
    fn deeper(&self, indent: usize) -> Option<usize> {
        let next = self.lines.get(self.at)?;
        (next.indent > indent).then_some(next.indent)
    }

    fn fields(&mut self, indent: usize, depth: usize) -> Option<Vec<(Name, Value)>> {
        let mut fields: Vec<(Name, Value)> = Vec::new();
        let mut known: HashMap<String, Span> = HashMap::new();
        while let Some(line) = self.lines.get(self.at)
            && line.indent == indent
        {
            let (start, text) = (line.start, line.text);
            let Some((name, rest)) = field(text) else {
                self.wrong((start, text.len()), "expected `NAME: VALUE`");
                return None;
            };
            self.at += 1;
            let span = Span::new(self.source, start, start + name.len());
            let name = Name::new(name.trim_matches(['"', '\'']), span);
            let value = rest.trim_start();
            let value = if value.is_empty() {
                let next = self.lines.get(self.at);
                // The signs of a list may stand below its name.
                let is_list = next.is_some_and(|next| {
                    next.indent == indent && (next.text == "-" || next.text.starts_with("- "))
                });
                let own = if is_list {
                    Some(indent)
                } else {
                    self.deeper(indent)
                };
                match own {
                    Some(own) => self.block(own, depth + 1)?,
                    None => Value {
                        span,
                        kind: Kind::Nothing,
                    },
                }
            } else {
                self.word(start + text.len() - value.len(), value)?
            };
            if let Some(first) = known.insert(name.text.clone(), name.span) {
                let message = format!("`{}` occurs twice", name.text);
                let error = Diagnostic::error("duplicate-name", name.span, message);
                self.found.push(error.label(first, "first here"));
                return None;
            }
            fields.push((name, value));
        }
        Some(fields)
    }

    fn word(&mut self, start: usize, text: &str) -> Option<Value> {
        let place = (start, text.len());
        if text.starts_with(['{', '[', '&', '*', '|', '>', '!', '%', '@', '`']) {
            let message =
                "sets have names, lists and words on lines of their own, and nothing else of YAML";
            return self.wrong(place, message);
        }
        let mut word = text;
        for quote in ['"', '\''] {
            if let Some(rest) = text.strip_prefix(quote) {
                let inside = rest.strip_suffix(quote);
                let inside = inside.filter(|inside| !inside.contains([quote, '\\']));
                match inside {
                    Some(inside) => word = inside,
                    None => return self.wrong(place, "a text in quotes ends on its line"),
                }
            }
        }
        Some(Value {
            span: Span::new(self.source, start, start + text.len()),
            kind: Kind::Word(word.to_owned()),
        })
    }
}
