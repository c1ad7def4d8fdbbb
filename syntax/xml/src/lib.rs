//! XML with locations, for the languages that are written in XML.
//!
#![doc = include_str!("example.md")]

use rc_diagnostics::{Diagnostic, Name, SourceId, Span};
use roxmltree::{Attribute, Document, Error, Node};
use std::ops::Range;

/// An XML text.
#[derive(Clone, Copy, Debug)]
pub struct XmlSource<'a> {
    /// The text's place in the map of sources.
    pub source: SourceId,
    /// The text.
    pub text: &'a str,
    /// The name of the outermost element, for messages.
    pub root: &'static str,
    /// The code of the error that refuses a document type.
    pub not_supported: &'static str,
}

impl<'a> XmlSource<'a> {
    /// Parses the text. Document types are refused, so that entities cannot expand without limit.
    pub fn parse(self) -> Result<Document<'a>, Diagnostic> {
        if self.text.trim().is_empty() {
            let root = self.root;
            let message = format!("expected `<{root} …> … </{root}>`, found an empty file");
            return Err(Diagnostic::error("empty-file", self.span(0..0), message));
        }
        Document::parse(self.text).map_err(|error| self.malformed(&error))
    }

    fn malformed(self, error: &Error) -> Diagnostic {
        let end = self.text.trim_end().len();
        let at = match error {
            Error::DtdDetected => {
                let at = self.text.find("<!DOCTYPE").unwrap_or(0);
                let message = "document types are not supported";
                let span = self.span(at..at + "<!DOCTYPE".len());
                return Diagnostic::error(self.not_supported, span, message);
            }
            Error::UnclosedRootNode | Error::UnexpectedEndOfStream | Error::NoRootNode => end,
            _ => self.byte(error.pos().row, error.pos().col).min(end),
        };
        let length = self.text[at..].chars().next().map_or(0, char::len_utf8);
        // The span already has the position.
        let what = error.to_string();
        let what = what.replace(&format!(" at {}", error.pos()), "");
        let what = what.trim_end_matches(" found").replace('\'', "`");
        let message = format!("malformed XML: {what}");
        Diagnostic::error("malformed-xml", self.span(at..at + length), message)
    }

    /// The byte offset of a line and a column in characters, both from 1.
    fn byte(self, row: u32, column: u32) -> usize {
        let before = self.text.split_inclusive('\n').take(row as usize - 1);
        let start: usize = before.map(str::len).sum();
        let line = &self.text[start..];
        let column = line.char_indices().nth(column as usize - 1);
        start + column.map_or(line.len(), |(at, _)| at)
    }

    /// A range of the text as a location.
    pub fn span(self, range: Range<usize>) -> Span {
        Span::new(self.source, range.start, range.end)
    }

    /// The text at a location.
    pub fn slice(self, span: Span) -> &'a str {
        self.text.get(span.start..span.end).unwrap_or_default()
    }

    /// The location of an element's name in its start tag.
    pub fn tag(self, node: Node<'_, '_>) -> Span {
        let start = node.range().start + 1;
        let rest = self.text.get(start..).unwrap_or_default();
        let end = rest.find(|c: char| c.is_whitespace() || c == '/' || c == '>');
        self.span(start..start + end.unwrap_or(rest.len()))
    }

    /// The location of an attribute's name.
    pub fn attribute_name(self, attribute: &Attribute<'_, '_>) -> Span {
        let start = attribute.range().start;
        let rest = self.text.get(start..).unwrap_or_default();
        let end = rest.find(|c: char| c.is_whitespace() || c == '=');
        self.span(start..start + end.unwrap_or(rest.len()))
    }

    /// The value of an attribute without a namespace, and its location without the quotes.
    pub fn attribute(self, node: Node<'_, '_>, name: &str) -> Option<Name> {
        let mut all = node.attributes();
        let attribute = all.find(|a| a.namespace().is_none() && a.name() == name)?;
        Some(self.attribute_value(&attribute))
    }

    /// The value of an attribute, and its location without the quotes.
    pub fn attribute_value(self, attribute: &Attribute<'_, '_>) -> Name {
        let whole = attribute.range();
        let written = self.text.get(whole.clone()).unwrap_or_default();
        // The value is last. Its quotes are one byte each and do not occur in it.
        let quote = written.chars().next_back();
        let open = quote.and_then(|quote| written.find(quote));
        let start = open.map_or(whole.start, |open| whole.start + open + 1);
        let end = whole.end.saturating_sub(1).max(start);
        Name::new(attribute.value(), self.span(start..end))
    }

    /// The elements of a list separated by white space.
    pub fn tokens(self, value: &Name) -> Vec<Name> {
        let as_written = self.slice(value.span) == value.text;
        let words = value.text.split_whitespace();
        let start = value.text.as_ptr() as usize;
        words
            .map(|word| {
                let at = value.span.start + (word.as_ptr() as usize - start);
                let span = if as_written {
                    self.span(at..at + word.len())
                } else {
                    value.span
                };
                Name::new(word, span)
            })
            .collect()
    }

    /// The location of the first line of text between elements. `None` if it is only white space.
    pub fn words(self, node: Node<'_, '_>) -> Option<Span> {
        let range = node.range();
        let written = self.text.get(range.clone())?;
        let start = range.start + (written.len() - written.trim_start().len());
        let first = written.trim().lines().next()?.trim_end();
        Some(self.span(start..start + first.len()))
    }
}
