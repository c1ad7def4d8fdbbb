//! The formatter. It prints the syntax tree, and the comments where they were.

use crate::ast::{
    Entry, Field, Item, ItemKind, Map, Operand, OperandKind, Representation, Shape, Value,
};
use crate::parse::parse;
use rc_diagnostics::SourceMap;
use rc_syntax::{Trivia, with_ends_of};

/// Longer lines of entries are broken.
const WIDTH: usize = 100;

/// Formats `text`, and keeps its ends of lines. A text with an error stays as it is.
pub fn format(text: &str) -> String {
    let mut sources = SourceMap::new();
    let source = sources.add("a.dproto", text);
    let (file, found) = parse(&sources, source);
    if found.has_errors() {
        return text.to_owned();
    }
    let trivia = Trivia::new(text);
    let mut printer = Printer {
        text,
        comments: trivia.comments(),
        out: String::with_capacity(text.len()),
        last: 0,
    };
    for item in &file.items {
        printer.item(item);
    }
    printer.comments_before(text.len(), 0);
    with_ends_of(text, printer.out)
}

struct Printer<'a> {
    text: &'a str,
    /// Those that are not printed.
    comments: &'a [(usize, usize)],
    out: String,
    /// Where the last printed piece ends in the text.
    last: usize,
}

/// The names of a line, and what is between them.
fn joined(parts: &[&str]) -> String {
    parts.concat()
}

fn operand(operand: &Operand, text: &str) -> String {
    match &operand.kind {
        // As written, with its escapes.
        OperandKind::Text(_) => text[operand.span.start..operand.span.end].to_owned(),
        _ => operand.text(),
    }
}

fn entry(entry: &Entry, text: &str) -> String {
    let left = operand(&entry.left, text);
    match &entry.right {
        Some((relation, right)) => {
            let minus = if entry.minus.is_some() { "-" } else { "" };
            format!("{left} {} {minus}{}", relation.text, operand(right, text))
        }
        None => left,
    }
}

fn representation(of: &Representation) -> String {
    format!("{}{{{}}}", of.language.text, of.model.text)
}

impl Printer<'_> {
    /// Lines between the last piece and `start`: one blank line at most, none at the beginning of
    /// the file and of a block.
    fn gap(&mut self, start: usize) {
        let between = self.text.get(self.last..start).unwrap_or_default();
        let lines = between.replace("\r\n", "\n").matches(['\n', '\r']).count();
        if lines > 1 && !self.out.is_empty() && !self.out.ends_with("{\n") {
            self.out.push('\n');
        }
    }

    fn indent(&mut self, depth: usize) {
        self.out.extend(std::iter::repeat_n("    ", depth));
    }

    fn comment(&mut self, (start, stop): (usize, usize)) {
        let comment = self.text[start..stop].trim_end();
        let lines: Vec<&str> = comment.split('\n').map(str::trim_end).collect();
        self.out.push_str(&lines.join("\n"));
        self.last = start + comment.len();
    }

    /// Prints the comments that begin before `end`, each on a line of its own.
    fn comments_before(&mut self, end: usize, depth: usize) {
        while let Some(&(start, stop)) = self.comments.first().filter(|(start, _)| *start < end) {
            self.comments = &self.comments[1..];
            self.gap(start);
            self.indent(depth);
            self.comment((start, stop));
            self.out.push('\n');
        }
    }

    /// Prints one piece of the text on a line of its own. The comments inside it come before it; a
    /// comment after it on its line stays there.
    fn line(&mut self, (start, end): (usize, usize), depth: usize, line: &str) {
        self.comments_before(end, depth);
        self.gap(start);
        self.indent(depth);
        self.out.push_str(line);
        self.end(end);
    }

    /// Ends a line, after the comments that are on it.
    fn end(&mut self, end: usize) {
        self.last = end;
        while let Some(&(start, stop)) = self.comments.first() {
            let between = self.text.get(self.last..start).unwrap_or_default();
            if !between
                .chars()
                .all(|c| c == ' ' || c == '\t' || c == ',' || c == ';')
            {
                break;
            }
            self.comments = &self.comments[1..];
            self.out.push(' ');
            self.comment((start, stop));
        }
        self.out.push('\n');
    }

    /// A map on one line. `None` if it has lines of its own, or is too long.
    fn inline(&self, map: &Map, before: usize) -> Option<String> {
        let first = map.entries.first()?;
        let has_lines = self.text[map.span.start..first.span.start].contains(['\n', '\r']);
        let entries: Vec<String> = map.entries.iter().map(|e| entry(e, self.text)).collect();
        let line = format!("{{ {} }}", entries.join(", "));
        (!has_lines && before + line.chars().count() <= WIDTH).then_some(line)
    }

    /// The lines of a map, broken where they are, and where they are too long.
    fn entries(&mut self, map: &Map, depth: usize) {
        let mut at = 0;
        while at < map.entries.len() {
            let (from, mut line) = (at, String::new());
            while let Some(next) = map.entries.get(at) {
                let piece = entry(next, self.text);
                if at > from {
                    let between = &self.text[map.entries[at - 1].span.end..next.span.start];
                    let width = depth * 4 + line.chars().count() + piece.chars().count() + 2;
                    if between.contains(['\n', '\r']) || width > WIDTH {
                        break;
                    }
                    line.push(' ');
                }
                line.push_str(&piece);
                at += 1;
                line.push_str(if at < map.entries.len() { "," } else { "" });
            }
            let place = (map.entries[from].span.start, map.entries[at - 1].span.end);
            self.line(place, depth, &line);
        }
    }

    fn close(&mut self, end: usize, depth: usize) {
        self.comments_before(end, depth + 1);
        // No blank line before a brace.
        self.last = end;
        self.indent(depth);
        self.out.push('}');
        self.end(end);
    }

    fn field(&mut self, field: &Field, width: usize) {
        let head = format!("{:width$} = ", field.name.text);
        let place = (field.span.start, field.span.end);
        match &field.value {
            Value::Representation(of) => {
                self.line(place, 1, &format!("{head}:: {}", representation(of)));
            }
            Value::Operand(value) => {
                self.line(place, 1, &format!("{head}{}", operand(value, self.text)));
            }
            Value::Map(map) if map.entries.is_empty() => {
                self.line(place, 1, &format!("{head}{{ }}"));
            }
            Value::Map(map) => {
                if let Some(line) = self.inline(map, 4 + head.chars().count()) {
                    self.line(place, 1, &format!("{head}{line}"));
                } else {
                    let open = (field.span.start, map.span.start + 1);
                    self.line(open, 1, &format!("{head}{{"));
                    self.entries(map, 2);
                    self.close(map.span.end, 1);
                }
            }
        }
    }

    fn item(&mut self, item: &Item) {
        let (start, end) = (item.span.start, item.span.end);
        let mut whole = |parts: &[&str]| self.line((start, end), 0, &joined(parts));
        match &item.kind {
            ItemKind::Import(path) => {
                let path = &self.text[path.span.start..path.span.end];
                self.line((start, end), 0, &format!("import {path};"));
            }
            ItemKind::Axes(name, directions) => {
                let words: Vec<&str> = directions.iter().map(|d| d.text.as_str()).collect();
                whole(&["axes ", &name.text, " :: ", &words.join(", ")]);
            }
            ItemKind::Algebraic(name, shape) => {
                let shape = match shape {
                    Shape::Scalar(names) => {
                        let names: Vec<&str> = names.iter().map(|n| n.text.as_str()).collect();
                        format!("Scalar{{{}}}", names.join(", "))
                    }
                    Shape::Vector(length) => format!("Vector{{{}}}", length.text),
                    Shape::Matrix(rows, columns) => {
                        format!("Matrix{{{}, {}}}", rows.text, columns.text)
                    }
                };
                whole(&["algebraic ", &name.text, " :: ", &shape]);
            }
            ItemKind::Ddr(name, of) => {
                whole(&["ddr ", &name.text, " :: ", &representation(of)]);
            }
            ItemKind::Conversion(from, to, by) => {
                whole(&["conversion ", &from.text, " -> ", &to.text, " = ", &by.text]);
            }
            ItemKind::Load(library) => whole(&["load ", &library.text]),
            ItemKind::Units(name, vocabulary, of, map) => {
                let head = [
                    "units ",
                    &name.text,
                    " :: ",
                    &vocabulary.text,
                    ", ",
                    &of.text,
                ];
                self.map_item(item, &joined(&head), map);
            }
            ItemKind::Alias(left, right, map) => {
                let head = ["alias ", &left.text, " <-> ", &right.text];
                self.map_item(item, &joined(&head), map);
            }
            ItemKind::View(of, part, to, map) => {
                let head = ["view ", &of.text, ".", &part.text, " -> ", &to.text];
                self.map_item(item, &joined(&head), map);
            }
            ItemKind::Function(name, language, fields) => {
                let language = language.as_ref().map(|l| format!(" {}", l.text));
                let language = language.unwrap_or_default();
                let head = ["fproto ", &name.text, " ::", &language];
                self.block(item, &joined(&head), fields);
            }
            ItemKind::Domain(name, fields) => {
                self.block(item, &joined(&["domain ", &name.text, " ::"]), fields);
            }
            ItemKind::Prototype(name, domain, fields) => {
                let head = ["dproto ", &name.text, " :: ", &domain.text];
                self.block(item, &joined(&head), fields);
            }
        }
    }

    fn map_item(&mut self, item: &Item, head: &str, map: &Map) {
        if map.entries.is_empty() {
            self.line(
                (item.span.start, item.span.end),
                0,
                &format!("{head} {{ }}"),
            );
        } else if let Some(line) = self.inline(map, head.chars().count() + 1) {
            self.line(
                (item.span.start, item.span.end),
                0,
                &format!("{head} {line}"),
            );
        } else {
            self.line((item.span.start, map.span.start), 0, head);
            self.open(map.span.start + 1);
            self.entries(map, 1);
            self.close(map.span.end, 0);
        }
    }

    fn block(&mut self, item: &Item, head: &str, fields: &[Field]) {
        let header = &self.text[item.span.start..item.span.end];
        let first = fields
            .first()
            .map_or(item.span.end, |field| field.span.start);
        let before = &self.text[item.span.start..first];
        // The brace is the last one before the first field; comments may have others.
        let open = self
            .brace(item.span.start, first)
            .unwrap_or(header.len().min(before.len()));
        self.line((item.span.start, open), 0, head);
        self.open(open + 1);
        let width = fields.iter().map(|field| field.name.text.len()).max();
        for field in fields {
            self.field(field, width.unwrap_or_default());
        }
        self.close(item.span.end, 0);
    }

    /// The first `{` between two places that is in no comment.
    fn brace(&self, start: usize, end: usize) -> Option<usize> {
        let trivia = Trivia::new(&self.text[start..end]);
        let mut braces = self.text[start..end].match_indices('{');
        let in_comment = |at: usize| {
            trivia
                .comments()
                .iter()
                .any(|(a, b)| (*a..*b).contains(&at))
        };
        let found = braces.find(|(at, _)| !in_comment(*at));
        found.map(|(at, _)| start + at)
    }

    fn open(&mut self, end: usize) {
        self.out.push('{');
        self.end(end);
    }
}
