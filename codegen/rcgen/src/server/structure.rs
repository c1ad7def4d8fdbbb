//! The structure of a text, also of a broken one: its blocks, statements and comments in the languages with
//! braces, its elements in XML, its tables in TOML.

use rc_diagnostics::SourceMap;
use rc_syntax::{Token, TokenKind, tokens};
use rc_xml::XmlSource;
use std::path::Path;

/// A part of a text that has a name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Block {
    /// All of it, as bytes.
    pub(super) start: usize,
    pub(super) end: usize,
    /// Its name.
    pub(super) name: (usize, usize),
    /// Begin and end of its content.
    pub(super) inside: (usize, usize),
}

/// A text by its tokens.
pub(super) struct Structure<'a> {
    text: &'a str,
    /// All tokens without comments.
    tokens: Vec<Token<'a>>,
    comments: Vec<Token<'a>>,
    /// For an opening sign its closing one, and the other way round. Its own number for others.
    partners: Vec<usize>,
    /// The innermost `{` around a token.
    around: Vec<Option<usize>>,
}

impl<'a> Structure<'a> {
    pub(super) fn of(text: &'a str) -> Self {
        let (comments, tokens): (Vec<Token<'a>>, Vec<Token<'a>>) = tokens(text)
            .into_iter()
            .partition(|token| token.kind == TokenKind::Comment);
        let mut partners: Vec<usize> = (0..tokens.len()).collect();
        let mut around = Vec::with_capacity(tokens.len());
        let mut open: Vec<usize> = Vec::new();
        let mut braces: Vec<usize> = Vec::new();
        for (at, token) in tokens.iter().enumerate() {
            match token.text {
                "{" | "(" => {
                    around.push(braces.last().copied());
                    open.push(at);
                    if token.text == "{" {
                        braces.push(at);
                    }
                    continue;
                }
                ")" if open.last().is_some_and(|open| tokens[*open].text == "(") => {
                    join(&mut partners, open.pop(), at);
                }
                "}" => {
                    // A `(` without its `)` ends with the block.
                    while open.last().is_some_and(|open| tokens[*open].text == "(") {
                        open.pop();
                    }
                    join(&mut partners, open.pop(), at);
                    braces.pop();
                }
                _ => {}
            }
            around.push(braces.last().copied());
        }
        Self {
            text,
            tokens,
            comments,
            partners,
            around,
        }
    }

    fn end(&self, at: usize) -> usize {
        let token = &self.tokens[at];
        token.start + token.text.len()
    }

    /// The token at a byte, or before it.
    fn at(&self, byte: usize) -> Option<usize> {
        let behind = self.tokens.partition_point(|token| token.start <= byte);
        behind.checked_sub(1)
    }

    /// Whether a byte is directly in a block whose head begins with a word.
    pub(super) fn is_in(&self, byte: usize, word: &str) -> bool {
        let open = self.at(byte).and_then(|at| self.around[at]);
        let head = open.and_then(|open| open.checked_sub(1));
        let first = head.map(|head| self.first(head, false));
        first.is_some_and(|first| self.tokens[first].text.eq_ignore_ascii_case(word))
    }

    /// The first token of a statement; with `commas` of a part of it between commas.
    fn first(&self, mut at: usize, commas: bool) -> usize {
        while let Some(before) = at.checked_sub(1) {
            match self.tokens[before].text {
                ";" | "{" | "}" | "(" => break,
                "," if commas => break,
                ")" => at = self.partners[before].min(before),
                _ => at = before,
            }
        }
        at
    }

    /// The declaration around a byte: from the first token of its statement to its `;`, over its block.
    /// With `commas`, the part of a statement between commas.
    pub(super) fn declaration(&self, byte: usize, commas: bool) -> (usize, usize) {
        let Some(at) = self.at(byte) else {
            return (byte, byte);
        };
        let start = self.tokens[self.first(at, commas)].start;
        let mut last = at;
        let mut next = at;
        while let Some(token) = self.tokens.get(next) {
            match token.text {
                "}" | ")" => break,
                "," if commas => break,
                ";" => {
                    if !commas {
                        last = next;
                    }
                    break;
                }
                "(" => next = self.partners[next].max(next),
                "{" => {
                    let close = self.partners[next].max(next);
                    last = close;
                    next = close + 1;
                    match self.tokens.get(next).map(|token| token.text) {
                        // The choices of a parameter are not a block.
                        Some(text) if !matches!(text, ";" | "}" | ",") && !self.is_block(close) => {
                        }
                        Some(";") if !commas => {
                            last = next;
                            break;
                        }
                        _ => break,
                    }
                    continue;
                }
                _ => {}
            }
            last = next;
            next += 1;
        }
        (start.min(byte), self.end(last))
    }

    /// The statement or the block that a sign at a byte ends.
    pub(super) fn ended_by(&self, byte: usize) -> (usize, usize) {
        let Some(at) = self.at(byte) else {
            return (byte, byte);
        };
        // The token before a `;` may be the end of the block of the statement.
        let mut last = at;
        if self.tokens[at].text == ";"
            && let Some(before) = at.checked_sub(1)
        {
            last = before;
        }
        let head = match self.tokens[last].text {
            "}" => self.partners[last].min(last).saturating_sub(1),
            _ => last,
        };
        (self.tokens[self.first(head, false)].start, self.end(at))
    }

    /// Whether the braces that end at a token contain statements.
    fn is_block(&self, close: usize) -> bool {
        let open = self.partners[close].min(close);
        let inside = self.tokens.get(open..close).unwrap_or_default();
        inside.iter().any(|token| token.text == ";")
    }

    /// The blocks, each with the word that names it: the second one of its head, or the only one.
    pub(super) fn blocks(&self) -> Vec<Block> {
        let opens = self.tokens.iter().enumerate();
        let opens = opens.filter(|(_, token)| token.text == "{");
        opens
            .filter_map(|(open, token)| {
                let first = self.first(open, false);
                if first == open {
                    return None;
                }
                let close = self.partners[open].max(open);
                let is_closed = close > open;
                let is_word = |at: &usize| {
                    matches!(self.tokens[*at].kind, TokenKind::Word | TokenKind::String)
                };
                let mut words = (first..open).filter(is_word);
                let (one, other) = (words.next()?, words.next());
                let name = other.unwrap_or(one);
                let mut last = if is_closed {
                    close
                } else {
                    self.tokens.len() - 1
                };
                let end = if is_closed {
                    self.tokens[close].start
                } else {
                    self.text.len()
                };
                if self
                    .tokens
                    .get(last + 1)
                    .is_some_and(|token| token.text == ";")
                {
                    last += 1;
                }
                Some(Block {
                    start: self.tokens[first].start,
                    end: self.end(last),
                    name: (self.tokens[name].start, self.end(name)),
                    inside: (token.start + 1, end),
                })
            })
            .collect()
    }

    /// The folds, as bytes, each with its kind.
    pub(super) fn folds(&self) -> Vec<(usize, usize, Option<&'static str>)> {
        let mut folds = Vec::new();
        for (open, token) in self.tokens.iter().enumerate() {
            let close = self.partners[open];
            if token.text == "{" && close > open {
                // With the line of its head, where `{` has a line of its own.
                let head = if self.first(open, false) < open {
                    self.tokens[open - 1].start
                } else {
                    token.start
                };
                folds.push((head, self.tokens[close].start, None));
            }
        }
        let mut run: Option<(usize, usize)> = None;
        for comment in &self.comments {
            let end = comment.start + comment.text.len();
            let is_line = comment.text.starts_with("//");
            match run {
                Some((start, before)) if is_line && self.follows(before, comment.start) => {
                    run = Some((start, end));
                }
                _ => {
                    folds.extend(run.map(|(start, end)| (start, end, Some("comment"))));
                    run = Some((comment.start, end));
                }
            }
        }
        folds.extend(run.map(|(start, end)| (start, end, Some("comment"))));
        let imports = self.tokens.iter().enumerate().filter(|(at, token)| {
            let begins = *at == 0 || self.tokens[at - 1].text == ";";
            begins && token.text.eq_ignore_ascii_case("import")
        });
        let imports: Vec<usize> = imports.map(|(at, _)| at).collect();
        if let (Some(first), Some(last)) = (imports.first(), imports.last()) {
            let (_, end) = self.declaration(self.tokens[*last].start, false);
            folds.push((self.tokens[*first].start, end, Some("imports")));
        }
        folds
    }

    /// Whether only one end of a line is between two bytes.
    fn follows(&self, before: usize, next: usize) -> bool {
        let between = self.text.get(before..next).unwrap_or_default();
        between.trim().is_empty()
            && between.replace("\r\n", "\n").matches(['\n', '\r']).count() == 1
    }

    /// The parts of the text around a byte.
    pub(super) fn around(&self, byte: usize) -> Vec<(usize, usize)> {
        let mut parts = vec![(0, self.text.len())];
        for comment in &self.comments {
            parts.push((comment.start, comment.start + comment.text.len()));
        }
        if let Some(at) = self.at(byte) {
            let token = &self.tokens[at];
            let end = self.end(at);
            // Between a word and a sign, the word is meant.
            for at in [Some(at), at.checked_sub(1)].into_iter().flatten() {
                if self.tokens[at].kind != TokenKind::Punctuation {
                    parts.push((self.tokens[at].start, self.end(at)));
                }
            }
            if token.kind == TokenKind::String && token.text.len() > 1 && token.text.ends_with('"')
            {
                parts.push((token.start + 1, end - 1));
            }
            parts.push(self.declaration(token.start, true));
            parts.push(self.declaration(token.start, false));
        }
        let brackets = self.tokens.iter().enumerate();
        for (open, token) in brackets.filter(|(open, _)| self.partners[*open] > *open) {
            let close = self.partners[open];
            let (start, end) = (token.start, self.end(close));
            if start <= byte && byte <= end {
                parts.push((start, end));
                parts.push((start + 1, self.tokens[close].start));
                if token.text == "{" {
                    parts.push(self.declaration(token.start, false));
                }
            }
        }
        parts.retain(|(start, end)| start <= &byte && &byte <= end && start < end);
        parts
    }
}

fn join(partners: &mut [usize], open: Option<usize>, close: usize) {
    if let Some(open) = open {
        partners[open] = close;
        partners[close] = open;
    }
}

/// The blocks of a file in its language.
pub(super) fn blocks(path: &Path, text: &str) -> Vec<Block> {
    match path.extension().and_then(|ending| ending.to_str()) {
        Some("toml") => tables(text),
        Some("xml" | "urdf" | "scxml") => elements(text),
        Some("graph" | "rs" | "py") => Vec::new(),
        _ => Structure::of(text).blocks(),
    }
}

/// The tables of a TOML text.
fn tables(text: &str) -> Vec<Block> {
    let mut all: Vec<Block> = Vec::new();
    let mut at = 0;
    for line in text.split_inclusive('\n') {
        let header = line.trim();
        if let Some(name) = header.strip_prefix('[') {
            let name = name
                .trim_start_matches('[')
                .split(']')
                .next()
                .unwrap_or_default();
            let start = at + line.find('[').unwrap_or(0);
            let from = start + line.trim_start().find(name).unwrap_or(0);
            all.push(Block {
                start,
                end: start,
                name: (from, from + name.len()),
                inside: (at + line.len(), at + line.len()),
            });
        }
        at += line.len();
        if let Some(last) = all.last_mut().filter(|_| !header.is_empty()) {
            last.end = at - (line.len() - line.trim_end().len());
            last.inside.1 = last.end.max(last.inside.0);
        }
    }
    all.retain(|block| block.name.0 < block.name.1);
    all
}

/// The elements of an XML text, by their `id`, `name` or tag. None of a text with errors.
fn elements(text: &str) -> Vec<Block> {
    let mut sources = SourceMap::new();
    let source = sources.add("", text);
    // Without the mark that the map drops.
    let text = sources.text(source);
    let xml = XmlSource {
        source,
        text,
        root: "",
        not_supported: "",
    };
    let Ok(document) = xml.parse() else {
        return Vec::new();
    };
    let elements = document.descendants().filter(roxmltree::Node::is_element);
    elements
        .map(|node| {
            let named = ["id", "name"]
                .into_iter()
                .find_map(|name| xml.attribute(node, name));
            let name = named.map_or(xml.tag(node), |name| name.span);
            let range = node.range();
            let first = node.first_child().map(|child| child.range().start);
            let last = node.last_child().map(|child| child.range().end);
            Block {
                start: range.start,
                end: range.end,
                name: (name.start, name.end),
                inside: (first.unwrap_or(range.end), last.unwrap_or(range.end)),
            }
        })
        .filter(|block| block.name.0 < block.name.1)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn declaration(text: &str, commas: bool) -> String {
        let at = text.find('|').expect("a place");
        let text = text.replace('|', "");
        let (start, end) = Structure::of(&text).declaration(at, commas);
        text[start..end].to_owned()
    }

    #[test]
    fn a_declaration_reaches_over_its_block_also_in_broken_texts() {
        for (text, commas, expected) in [
            ("a; struct |S { int b; }; c", false, "struct S { int b; };"),
            ("enum E { a, |b, c };", true, "b"),
            (
                "@range(min=1, max=2) int |b; c",
                false,
                "@range(min=1, max=2) int b;",
            ),
            (
                "mode string |m \"x\" {x, y} T; z",
                false,
                "mode string m \"x\" {x, y} T;",
            ),
            (
                "implements |A { depth 1; }, B;",
                true,
                "implements A { depth 1; }",
            ),
            // A block without an end reaches to the end.
            ("} ) |a { b", false, ") a { b"),
            ("|", false, ""),
        ] {
            assert_eq!(declaration(text, commas), expected, "{text}");
        }
    }

    #[test]
    fn tables_and_elements_are_blocks() {
        let names = |path: &str, text: &str| {
            let blocks = blocks(Path::new(path), text);
            let shown = blocks.iter().map(|block| {
                let name = &text[block.name.0..block.name.1];
                format!("{name}={}", &text[block.start..block.end])
            });
            shown.collect::<Vec<_>>()
        };
        let toml = "x = 1\n[a]\ny = 2\n\n[[b.c]]\nz = 3\n";
        assert_eq!(
            names("a.toml", toml),
            ["a=[a]\ny = 2", "b.c=[[b.c]]\nz = 3"]
        );
        let xml = "<t><u id=\"v\"/></t>";
        assert_eq!(
            names("a.xml", xml),
            [format!("t={xml}"), "v=<u id=\"v\"/>".to_owned()]
        );
        assert_eq!(names("a.xml", "<t>").len(), 0);
    }
}
