//! Rendering of diagnostics: for people, as one line each, or as JSON lines.

use crate::{Diagnostic, Diagnostics, Severity, SourceMap, Span};
use annotate_snippets::{AnnotationKind, Group, Level, Renderer, Snippet};
use serde_json::json;
use std::borrow::Cow;
use std::collections::HashSet;
use std::path::{Component, Path, PathBuf};

/// An output format for diagnostics.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Format {
    /// With excerpts of the source, for people.
    #[default]
    Human,
    /// `file:line:column: error[code]: message`, one line each, for editors and scripts.
    Short,
    /// One JSON object per line: `code`, `severity`, `message`, `file`, `start` and `end` (`line`,
    /// `column`), `labels` (locations with a `message`), `help`.
    Json,
}

impl std::str::FromStr for Format {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "human" => Ok(Self::Human),
            "short" => Ok(Self::Short),
            "json" => Ok(Self::Json),
            other => Err(format!(
                "unknown format `{other}`: expected `human`, `short` or `json`"
            )),
        }
    }
}

/// Renders all diagnostics in the order of their locations, each followed by a line feed.
///
/// Diagnostics that render equally appear once, for example those of a file that two components
/// read.
pub fn render(sources: &SourceMap, diagnostics: &Diagnostics, format: Format) -> String {
    let mut out = String::new();
    let mut printed = HashSet::new();
    for diagnostic in diagnostics.sorted() {
        if !printed.insert(short(sources, diagnostic)) {
            continue;
        }
        match format {
            Format::Human => out.push_str(&human(sources, diagnostic)),
            Format::Short => out.push_str(&short(sources, diagnostic)),
            Format::Json => out.push_str(&json_line(sources, diagnostic)),
        }
        out.push('\n');
    }
    out
}

fn human(sources: &SourceMap, diagnostic: &Diagnostic) -> String {
    let level = match diagnostic.severity {
        Severity::Error => Level::ERROR,
        Severity::Warning => Level::WARNING,
        Severity::Note => Level::NOTE,
    };
    let mut group = Group::with_title(level.primary_title(&diagnostic.message).id(diagnostic.code));
    group = group.element(snippet(sources, diagnostic, diagnostic.span.source));
    let mut others: Vec<_> = diagnostic
        .labels
        .iter()
        .map(|l| l.span.source)
        .filter(|s| *s != diagnostic.span.source)
        .collect();
    others.dedup();
    for other in others {
        group = group.element(snippet(sources, diagnostic, other));
    }
    if let Some(help) = &diagnostic.help {
        group = group.element(Level::HELP.message(help.as_str()));
    }
    Renderer::plain().render(&[group])
}

/// Replaces each byte of a secret in `text` by an asterisk. `text` is the excerpt of `source` from
/// byte `start` on. Its length stays the same, so that spans stay valid.
fn redacted<'a>(
    text: &'a str,
    source: crate::SourceId,
    start: usize,
    diagnostic: &Diagnostic,
) -> Cow<'a, str> {
    let mut out = Cow::Borrowed(text);
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
            out.to_mut().replace_range(from..to, &stars);
        }
    }
    out
}

fn snippet<'a>(
    sources: &'a SourceMap,
    diagnostic: &'a Diagnostic,
    source: crate::SourceId,
) -> Snippet<'a, annotate_snippets::Annotation<'a>> {
    let labels = diagnostic.labels.iter().map(|l| l.span);
    let spans = labels
        .chain([diagnostic.span])
        .filter(|s| s.source == source);
    let all = spans.reduce(Span::to).unwrap_or(diagnostic.span);
    // The renderer scans all text it gets: pass only the affected lines.
    let (start, end) = sources.lines(all);
    let text = redacted(&sources.text(source)[start..end], source, start, diagnostic);
    let within = |at: usize| at.clamp(start, end) - start;
    let range = |span: Span| within(span.start)..within(span.end);
    let mut snippet = Snippet::source(text)
        .line_start(sources.position(source, start).line)
        .path(shown(sources.path(source)));
    if source == diagnostic.span.source {
        snippet = snippet.annotation(AnnotationKind::Primary.span(range(diagnostic.span)));
    }
    for label in diagnostic.labels.iter().filter(|l| l.span.source == source) {
        let kind = if source == diagnostic.span.source {
            AnnotationKind::Context
        } else {
            AnnotationKind::Primary
        };
        snippet = snippet.annotation(kind.span(range(label.span)).label(label.message.as_str()));
    }
    snippet
}

/// A path for people: `a/b/../c` as `a/c`. JSON has the path with which the file was opened.
fn shown(path: &Path) -> String {
    let mut out = PathBuf::new();
    for part in path.components() {
        let before = out.components().next_back();
        match part {
            Component::ParentDir if matches!(before, Some(Component::Normal(_))) => {
                out.pop();
            }
            part => out.push(part),
        }
    }
    out.to_string_lossy().into_owned()
}

fn place(sources: &SourceMap, span: Span) -> String {
    let at = sources.position(span.source, span.start);
    format!(
        "{}:{}:{}",
        shown(sources.path(span.source)),
        at.line,
        at.column
    )
}

fn short(sources: &SourceMap, diagnostic: &Diagnostic) -> String {
    let Diagnostic {
        code,
        severity,
        message,
        ..
    } = diagnostic;
    let mut line = format!(
        "{}: {}[{code}]: {message}",
        place(sources, diagnostic.span),
        severity.name()
    );
    for label in &diagnostic.labels {
        line.push_str(&format!(
            "; {} at {}",
            label.message,
            place(sources, label.span)
        ));
    }
    if let Some(help) = &diagnostic.help {
        line.push_str(&format!(" ({help})"));
    }
    line
}

fn json_line(sources: &SourceMap, diagnostic: &Diagnostic) -> String {
    let range = |span: Span| {
        let (start, end) = (
            sources.position(span.source, span.start),
            sources.position(span.source, span.end),
        );
        json!({
            "file": sources.path(span.source).to_string_lossy(),
            "start": { "line": start.line, "column": start.column },
            "end": { "line": end.line, "column": end.column },
        })
    };
    let mut object = range(diagnostic.span);
    object["code"] = json!(diagnostic.code);
    object["severity"] = json!(diagnostic.severity.name());
    object["message"] = json!(diagnostic.message);
    object["help"] = json!(diagnostic.help);
    object["labels"] = diagnostic
        .labels
        .iter()
        .map(|label| {
            let mut place = range(label.span);
            place["message"] = json!(label.message);
            place
        })
        .collect();
    object.to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn people_see_no_detours() {
        for (path, seen) in [
            ("networks/../robot/a.cdsl", "robot/a.cdsl"),
            ("../robot/a.cdsl", "../robot/a.cdsl"),
            ("a/b/../../../c", "../c"),
            ("./a.idsl", "./a.idsl"),
            ("/../a", "/../a"),
            ("<shipped>/Laser.idsl", "<shipped>/Laser.idsl"),
        ] {
            assert_eq!(shown(Path::new(path)), seen);
        }
    }

    #[test]
    fn the_three_formats_give_the_same_location() {
        let mut sources = SourceMap::new();
        let a = sources.add("a.cdsl", "Component C {\n\tlanguage rsut;\n};\n");
        let mut found = Diagnostics::new();
        let span = Span::new(a, 24, 28);
        found.push(
            Diagnostic::error("unknown-language", span, "unknown language `rsut`")
                .suggest("rsut", ["rust"]),
        );
        assert_eq!(
            render(&sources, &found, Format::Short),
            "a.cdsl:2:11: error[unknown-language]: unknown language `rsut` (did you mean `rust`?)\n"
        );
        let value: serde_json::Value =
            serde_json::from_str(&render(&sources, &found, Format::Json))
                .expect("one JSON object a line");
        assert_eq!(value["start"], json!({"line": 2, "column": 11}));
        let human = render(&sources, &found, Format::Human);
        assert!(
            human.contains("a.cdsl:2:11") && human.contains("did you mean"),
            "{human}"
        );
    }
}
