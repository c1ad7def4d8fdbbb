//! A diagnostic with excerpts of its sources, for people.

use super::shown;
use crate::{Diagnostic, Severity, SourceId, SourceMap, Span};
use annotate_snippets::{AnnotationKind, Element, Group, Level, Origin, Renderer, Snippet};

/// The largest part of a source between two annotations of one excerpt, and of an annotation, in
/// bytes.
const EXCERPT: usize = 4 << 10;

/// The largest part of one line, which the renderer lays out as a whole.
const LONG_LINE: usize = 400;

/// How much of a longer line is shown before and after the annotations, in bytes.
const MARGIN: usize = 120;

pub(super) fn render(sources: &SourceMap, diagnostic: &Diagnostic, colours: bool) -> String {
    let level = match diagnostic.severity {
        Severity::Error => Level::ERROR,
        Severity::Warning => Level::WARNING,
        Severity::Note => Level::NOTE,
    };
    let title = level.primary_title(&diagnostic.message).id(diagnostic.code);
    let mut group = Group::with_title(title);
    let excerpts = excerpts(sources, diagnostic);
    for excerpt in &excerpts {
        group = group.elements(excerpt.elements(sources, diagnostic));
    }
    if let Some(help) = &diagnostic.help {
        group = group.element(Level::HELP.message(help.as_str()));
    }
    let renderer = if colours {
        Renderer::styled()
    } else {
        Renderer::plain()
    };
    renderer.render(&[group])
}

/// A part of one source with its annotations.
struct Excerpt<'a> {
    source: SourceId,
    /// From the first annotation to the end of the last one.
    start: usize,
    end: usize,
    annotations: Vec<(Span, Option<&'a str>)>,
}

/// The excerpts, that of the diagnostic's own location first. The renderer scans all that it gets,
/// so annotations that are far from each other get excerpts of their own.
fn excerpts<'a>(sources: &SourceMap, diagnostic: &'a Diagnostic) -> Vec<Excerpt<'a>> {
    let limit = |source: SourceId, from: usize| from + longest(sources.text(source), from);
    let labels = diagnostic.labels.iter();
    let labels = labels.map(|l| (l.span, Some(l.message.as_str())));
    let mut annotations: Vec<_> = std::iter::once((diagnostic.span, None))
        .chain(labels)
        .map(|(span, label)| {
            let end = span.end.min(limit(span.source, span.start));
            (
                Span::new(span.source, span.start, end.max(span.start)),
                label,
            )
        })
        .collect();
    annotations.sort_by_key(|(span, label)| (*span, label.is_some()));
    let mut all: Vec<Excerpt<'_>> = Vec::new();
    for annotation in annotations {
        let span = annotation.0;
        match all.last_mut() {
            Some(last)
                if last.source == span.source && span.start <= limit(span.source, last.end) =>
            {
                last.end = last.end.max(span.end);
                last.annotations.push(annotation);
            }
            _ => all.push(Excerpt {
                source: span.source,
                start: span.start,
                end: span.end,
                annotations: vec![annotation],
            }),
        }
    }
    for excerpt in &mut all {
        excerpt
            .annotations
            .sort_by_key(|(_, label)| label.is_some());
    }
    all.sort_by_key(|excerpt| !excerpt.has_location());
    all
}

/// The greatest gap, in bytes from `start`, between two annotations of one excerpt.
fn longest(text: &str, start: usize) -> usize {
    let bytes = text.as_bytes().get(start..).unwrap_or_default();
    let mut ends = bytes.iter().take(LONG_LINE);
    if ends.any(|byte| *byte == b'\n') || bytes.len() <= LONG_LINE {
        EXCERPT
    } else {
        LONG_LINE
    }
}

impl Excerpt<'_> {
    fn has_location(&self) -> bool {
        self.annotations.iter().any(|(_, label)| label.is_none())
    }

    fn elements<'e>(
        &'e self,
        sources: &'e SourceMap,
        diagnostic: &'e Diagnostic,
    ) -> Vec<Element<'e>> {
        let whole = sources.text(self.source);
        let path = shown(sources.path(self.source));
        let (first, last) = sources.lines(Span::new(self.source, self.start, self.end));
        let start = first.max(floor(whole, self.start.saturating_sub(MARGIN)));
        let cut = self.start - first > LONG_LINE;
        let start = if cut { start } else { first };
        let end = if last.saturating_sub(self.end) > LONG_LINE {
            floor(whole, self.end + MARGIN)
        } else {
            last
        };
        let text = redacted(&whole[start..end], self.source, start, diagnostic);
        // The renderer knows LF and CR LF. The other ends of lines have the same length.
        let text = with_line_feeds(text);
        let before = if cut { "…" } else { "" };
        let after = if end < last { "…" } else { "" };
        let line = sources.position(self.source, start).line;
        let place = sources.position(self.source, self.place());
        let mut snippet = Snippet::source(format!("{before}{text}{after}")).line_start(line);
        let mut elements = Vec::new();
        if cut {
            // The renderer would count the columns of the excerpt.
            let origin = Origin::path(path).line(place.line);
            elements.push(origin.char_column(place.column).into());
        } else {
            snippet = snippet.path(path);
        }
        let within = |at: usize| whole.floor_char_boundary(at.clamp(start, end)) - start;
        for (span, label) in &self.annotations {
            let kind = if self.has_location() && label.is_some() {
                AnnotationKind::Context
            } else {
                AnnotationKind::Primary
            };
            let range = before.len() + within(span.start)..before.len() + within(span.end);
            let annotation = kind.span(range);
            snippet = snippet.annotation(match label {
                Some(label) => annotation.label(*label),
                None => annotation,
            });
        }
        elements.push(snippet.into());
        elements
    }

    /// Where the excerpt is said to be.
    fn place(&self) -> usize {
        let own = self.annotations.iter().find(|(_, label)| label.is_none());
        own.map_or(self.start, |(span, _)| span.start)
    }
}

fn floor(text: &str, at: usize) -> usize {
    text.floor_char_boundary(at.min(text.len()))
}

fn with_line_feeds(text: String) -> String {
    if !text.contains('\r') {
        return text;
    }
    let mut out = String::with_capacity(text.len());
    let mut chars = text.chars().peekable();
    while let Some(c) = chars.next() {
        let lone = c == '\r' && chars.peek() != Some(&'\n');
        out.push(if lone { '\n' } else { c });
    }
    out
}

/// Replaces each byte of a secret in `text` by an asterisk. `text` is the excerpt of `source` from
/// byte `start` on. Its length stays the same, so that spans stay valid.
fn redacted(text: &str, source: SourceId, start: usize, diagnostic: &Diagnostic) -> String {
    let mut out = text.to_owned();
    for secret in diagnostic.secrets.iter().filter(|s| s.source == source) {
        let within = |at: usize| at.saturating_sub(start).min(text.len());
        let (from, to) = (within(secret.start), within(secret.end));
        let stars = text.get(from..to).map(|value| {
            let star = |c: char| {
                if matches!(c, '\n' | '\r') {
                    c.to_string()
                } else {
                    "*".repeat(c.len_utf8())
                }
            };
            value.chars().map(star).collect::<String>()
        });
        if let Some(stars) = stars.filter(|stars| !stars.is_empty()) {
            out.replace_range(from..to, &stars);
        }
    }
    out
}
