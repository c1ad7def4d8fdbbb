//! Edits of the text of a configuration.

use std::ops::Range;
use toml_edit::{Item, Table};

/// The text, the positions of its headers, and the edits.
pub(super) struct Text<'a> {
    whole: &'a str,
    /// The start of each `[table]` and `[[table]]`, in order.
    heads: Vec<usize>,
    edits: Vec<Edit>,
}

struct Edit {
    range: Range<usize>,
    order: InsertionOrder,
    with: String,
}

/// The order of insertions at one position.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum InsertionOrder {
    /// Values of the table above.
    Body,
    /// Another table.
    Table,
}

impl<'a> Text<'a> {
    pub(super) fn new(text: &'a str, root: &Table) -> Self {
        let mut heads = Vec::new();
        root.iter().for_each(|(_, item)| heads_in(item, &mut heads));
        let mut heads: Vec<usize> = heads.into_iter().map(|head| head.start).collect();
        heads.sort_unstable();
        Self {
            whole: text,
            heads,
            edits: Vec::new(),
        }
    }

    pub(super) fn slice(&self, range: Range<usize>) -> &'a str {
        self.whole.get(range).unwrap_or_default()
    }

    pub(super) fn replace(&mut self, range: Range<usize>, with: impl Into<String>) {
        self.edits.push(Edit {
            range,
            order: InsertionOrder::Body,
            with: with.into(),
        });
    }

    /// The start of the line with the position `at`.
    pub(super) fn line(&self, at: usize) -> usize {
        self.slice(0..at).rfind('\n').map_or(0, |feed| feed + 1)
    }

    /// The start of the next line.
    pub(super) fn next_line(&self, at: usize) -> usize {
        let feed = self.slice(at..self.whole.len()).find('\n');
        feed.map_or(self.whole.len(), |feed| at + feed + 1)
    }

    /// The end of the table with this header; without a header, the end of the text above all
    /// headers. A comment above the next header belongs to that header.
    pub(super) fn end_of(&self, head: Option<usize>) -> usize {
        let start = head.map_or(0, |head| self.next_line(head));
        let next = self.next_head(head);
        let end = next.map_or(self.whole.len(), |next| self.above(next));
        self.back(start, end, |line| line.trim().is_empty())
    }

    fn next_head(&self, head: Option<usize>) -> Option<usize> {
        let before = |next: &usize| head.is_some_and(|head| *next <= head);
        let at = self.heads.partition_point(before);
        self.heads.get(at).copied()
    }

    /// The start of the comment above a header. A comment at the start of the text belongs to the
    /// whole text.
    pub(super) fn above(&self, head: usize) -> usize {
        let line = self.line(head);
        let comment = |line: &str| line.trim_start().starts_with('#');
        match self.back(0, line, comment) {
            0 => line,
            above => above,
        }
    }

    /// The end of the text without trailing blank lines.
    pub(super) fn end(&self) -> usize {
        self.back(0, self.whole.len(), |line| line.trim().is_empty())
    }

    /// Moves `end` before the preceding lines that satisfy `so`, but not before `start`.
    fn back(&self, start: usize, mut end: usize, so: impl Fn(&str) -> bool) -> usize {
        while end > start {
            let line = self.line(end - 1);
            if line < start || !so(self.slice(line..end)) {
                break;
            }
            end = line;
        }
        end
    }

    /// Whether a line between the header `from` and the header after `to` starts with `words`.
    pub(super) fn has_line(&self, from: Option<usize>, to: Option<usize>, words: &str) -> bool {
        let end = self.next_head(to).unwrap_or(self.whole.len());
        let mut lines = self.slice(from.unwrap_or(0)..end).lines();
        lines.any(|line| line.trim_start().starts_with(words))
    }

    /// Inserts whole lines at `at`, the start of a line or the end of the text, between blank
    /// lines.
    pub(super) fn insert(&mut self, at: usize, order: InsertionOrder, lines: &str) {
        let above = self.slice(0..at);
        let last = above.strip_suffix('\n').unwrap_or(above);
        let last = last.rsplit('\n').next().unwrap_or_default();
        let before = match (last.trim().is_empty(), above.ends_with('\n')) {
            (true, _) => "",
            (false, true) => "\n",
            (false, false) => "\n\n",
        };
        let below = self.slice(at..self.next_line(at));
        let after = if below.trim().is_empty() { "" } else { "\n" };
        self.edits.push(Edit {
            range: at..at,
            order,
            with: format!("{before}{lines}{after}"),
        });
    }

    /// Turns the lines of `range` into comments below `note`.
    pub(super) fn comment_out(&mut self, range: Range<usize>, note: &str) {
        let range = self.line(range.start)..range.end;
        let mut out = String::new();
        if !note.is_empty() {
            out.push_str(&format!("# {note}\n"));
        }
        for line in self.slice(range.clone()).split_inclusive('\n') {
            out.push_str(if line.trim().is_empty() { "" } else { "# " });
            out.push_str(line);
        }
        self.replace(range, out);
    }

    /// Applies all edits. Keeps the line endings of the text.
    pub(super) fn finish(mut self) -> String {
        self.edits
            .sort_by_key(|edit| (edit.range.start, edit.range.end, edit.order));
        let mut merged: Vec<Edit> = Vec::new();
        for edit in self.edits.drain(..) {
            match merged.last_mut() {
                Some(last) if edit.range.is_empty() && last.range == edit.range => {
                    let first = last.with.trim_end_matches('\n');
                    last.with = format!("{first}\n\n{}", edit.with.trim_start_matches('\n'));
                }
                _ => merged.push(edit),
            }
        }
        let crlf = self.whole.contains("\r\n");
        let mut out = String::with_capacity(self.whole.len());
        let mut at = 0;
        for edit in merged {
            out.push_str(self.slice(at..edit.range.start));
            let with = edit.with.replace("\r\n", "\n");
            out.push_str(&if crlf {
                with.replace('\n', "\r\n")
            } else {
                with
            });
            at = edit.range.end.max(at);
        }
        out.push_str(self.slice(at..self.whole.len()));
        out
    }
}

/// Collects the headers of all tables in `item`.
pub(super) fn heads_in(item: &Item, out: &mut Vec<Range<usize>>) {
    let mut add = |table: &Table| {
        out.extend(head(table));
        table.iter().for_each(|(_, item)| heads_in(item, out));
    };
    match item {
        Item::Table(table) => add(table),
        Item::ArrayOfTables(tables) => tables.iter().for_each(add),
        Item::Value(_) | Item::None => {}
    }
}

/// The range of the header `[table]`. `None` for a table that exists only by headers of inner
/// tables or by dotted keys.
pub(super) fn head(table: &Table) -> Option<Range<usize>> {
    let written = !table.is_implicit() && !table.is_dotted();
    table.span().filter(|span| written && !span.is_empty())
}
