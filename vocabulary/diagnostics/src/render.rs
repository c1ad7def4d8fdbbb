//! Rendering of diagnostics: for people, as one line each, or as JSON lines.
//!
//! Time and size are bounded by the number of diagnostics and by [`MOST`], whatever the texts are:
//! excerpts, messages and labels have limits, and columns are counted once.

mod human;

use crate::foreign::{clean_lines, clean_to};
use crate::{Diagnostic, Diagnostics, Severity, SourceMap, Span};
use serde_json::json;
use std::collections::{BTreeSet, HashSet};
use std::path::{Component, Path, PathBuf};

/// How many diagnostics are printed. If there are more, errors come first, and the rest is counted.
pub const MOST: usize = 200;

/// How many labels of a diagnostic are printed.
const LABELS: usize = 12;

/// How many characters of a message, a label or a help are printed.
const LONGEST_TEXT: usize = 4000;

/// An output format for diagnostics.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Format {
    /// With excerpts of the source, for people.
    #[default]
    Human,
    /// `file:line:column: error[code]: message`, one line each, for editors and scripts.
    Short,
    /// One JSON object per line: `code`, `severity`, `message`, `file`, `start` and `end` (`line`,
    /// `column`), `labels` (locations with a `message`), `help`, `mend` (a location, the `text` that
    /// belongs there, and whether that is `certain`; null if none is known).
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

/// Renders the diagnostics in the order of their locations, each followed by a line feed.
///
/// Diagnostics that render equally appear once, for example those of a file that two components
/// read. At most [`MOST`] are printed, and the note `more-findings` counts the others.
pub fn render(sources: &SourceMap, diagnostics: &Diagnostics, format: Format) -> String {
    render_for(sources, diagnostics, format, false)
}

/// As [`render`]; for people in colours, which are escape sequences of a terminal.
pub fn render_for(
    sources: &SourceMap,
    diagnostics: &Diagnostics,
    format: Format,
    colours: bool,
) -> String {
    let mut out = String::new();
    for diagnostic in &printed(sources, diagnostics) {
        match format {
            Format::Human => out.push_str(&human::render(sources, diagnostic, colours)),
            Format::Short => out.push_str(&short(sources, diagnostic)),
            Format::Json => out.push_str(&json_line(sources, diagnostic)),
        }
        out.push('\n');
    }
    out
}

/// The diagnostic as it is printed, each text with a bound.
fn printed(sources: &SourceMap, diagnostics: &Diagnostics) -> Vec<Diagnostic> {
    let all = unique(sources, diagnostics);
    let is_error = |d: &&Diagnostic| d.severity == Severity::Error;
    if all.len() <= MOST {
        return all.into_iter().map(bounded).collect();
    }
    let errors = (0..all.len()).filter(|at| is_error(&all[*at]));
    let others = (0..all.len()).filter(|at| !is_error(&all[*at]));
    let chosen: BTreeSet<usize> = errors.chain(others).take(MOST).collect();
    let left: Vec<&Diagnostic> = (0..all.len())
        .filter(|at| !chosen.contains(at))
        .map(|at| all[at])
        .collect();
    let mut printed: Vec<Diagnostic> = chosen.iter().map(|at| bounded(all[*at])).collect();
    let errors = left.iter().copied().filter(|d| is_error(d)).count();
    let counted = |count: usize, word: &str| match count {
        0 => None,
        1 => Some(format!("1 more {word}")),
        _ => Some(format!("{count} more {word}s")),
    };
    let counts = [
        counted(errors, "error"),
        counted(left.len() - errors, "warning"),
    ];
    let counts: Vec<String> = counts.into_iter().flatten().collect();
    let verb = if left.len() == 1 { "is" } else { "are" };
    let message = format!("{} {verb} not printed", counts.join(" and "));
    printed.push(Diagnostic::note("more-findings", left[0].span, message));
    printed
}

/// The diagnostics in the order of their locations, without those that render as an earlier one.
fn unique<'a>(sources: &SourceMap, diagnostics: &'a Diagnostics) -> Vec<&'a Diagnostic> {
    let paths: Vec<String> = sources.ids().map(|id| shown(sources.path(id))).collect();
    let place = |span: Span| (&paths[span.source.index()], span.start, span.end);
    let mut seen = HashSet::new();
    let mut all = diagnostics.sorted();
    all.retain(|d| {
        let labels = d.labels.iter().map(|l| (place(l.span), &l.message));
        let labels: Vec<_> = labels.collect();
        seen.insert((place(d.span), d.code, &d.message, &d.help, labels))
    });
    all
}

/// The diagnostic with texts that a terminal shows and that have a limit.
fn bounded(diagnostic: &Diagnostic) -> Diagnostic {
    let text = |text: &str| clean_lines(text, LONGEST_TEXT);
    let mut out = diagnostic.clone();
    out.message = text(&out.message);
    out.help = out.help.as_deref().map(text);
    let more = out.labels.len().saturating_sub(LABELS);
    out.labels.truncate(LABELS);
    for label in &mut out.labels {
        label.message = text(&label.message);
    }
    if more > 0 {
        let places = format!("{more} more places are not printed");
        out.help = Some(match out.help {
            Some(help) => format!("{help}; {places}"),
            None => places,
        });
    }
    out
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
    clean_to(&out.to_string_lossy(), LONGEST_TEXT)
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
    // A name of the text may have a line feed, which would forge a finding.
    line.replace('\n', "\\n")
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
    let fix = diagnostic.fix.as_ref();
    let edit = fix.and_then(|fix| Some((fix.edit(sources, diagnostic.span)?, fix.certain)));
    object["mend"] = json!(edit.map(|(edit, certain)| {
        let mut place = range(edit.span);
        place["text"] = json!(edit.text);
        place["certain"] = json!(certain);
        place
    }));
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

    /// Findings in one line of `count` words, each with a label at the first one.
    fn many(count: usize, separator: &str) -> (SourceMap, Diagnostics) {
        let mut sources = SourceMap::new();
        let text = format!("wörd{separator}").repeat(count);
        let length = text.len() / count;
        let source = sources.add("a.idsl", text);
        let mut found = Diagnostics::new();
        let span = |at: usize| Span::new(source, at * length, at * length + 5);
        for at in 0..count {
            let message = format!("`wörd` no. {at}");
            found.push(
                Diagnostic::warning("duplicate-name", span(at), message)
                    .label(span(0), "first declared here"),
            );
        }
        let last = Span::new(source, (count - 1) * length, count * length);
        found.push(Diagnostic::error("syntax-error", last, "the only error"));
        (sources, found)
    }

    #[test]
    fn findings_beyond_a_number_are_counted() {
        let (sources, found) = many(16_000, " ");
        let text = render(&sources, &found, Format::Short);
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines.len(), MOST + 1);
        assert!(lines[MOST - 1].contains("the only error"), "{text}");
        assert_eq!(
            lines[MOST],
            "a.idsl:1:996: note[more-findings]: 15801 more warnings are not printed"
        );
        let (sources, found) = many(MOST - 1, " ");
        let text = render(&sources, &found, Format::Json);
        assert_eq!(text.lines().count(), MOST);
        assert!(!text.contains("more-findings"));
    }

    #[test]
    fn no_format_prints_more_of_a_long_text() {
        for separator in [" ", "\n"] {
            for format in [Format::Human, Format::Short, Format::Json] {
                let size = |count| {
                    let (sources, found) = many(count, separator);
                    render(&sources, &found, format).len()
                };
                let (some, many) = (size(1_000), size(16_000));
                assert!(many < some + some / 10, "{format:?}: {some} and {many}");
                assert!(many < 2_000_000, "{format:?}: {many}");
            }
        }
    }

    #[test]
    fn an_excerpt_of_a_long_line_has_the_place_in_the_file() {
        let mut sources = SourceMap::new();
        let text = format!(
            "{}\n{}!{}\n",
            "y",
            "xé ".repeat(50_000),
            " z".repeat(50_000)
        );
        let at = text.find('!').expect("a place");
        let source = sources.add("a.idsl", text);
        let mut found = Diagnostics::new();
        let span = Span::new(source, at, at + 1);
        let first = Span::new(source, 0, 1);
        found.push(Diagnostic::error("syntax-error", span, "wrong").label(first, "because of"));
        let text = render(&sources, &found, Format::Human);
        assert!(text.contains("--> a.idsl:2:150001\n"), "{text}");
        assert!(text.contains("2 | …"), "{text}");
        assert!(text.contains("::: a.idsl:1:1\n"), "{text}");
        assert!(text.len() < 2_000, "{text}");
    }

    #[test]
    fn texts_of_a_diagnostic_are_cleaned_and_bounded() {
        let mut sources = SourceMap::new();
        let source = sources.add("a\u{1b}[2J.idsl", "x");
        let span = Span::new(source, 0, 1);
        let mut found = Diagnostics::new();
        let mut diagnostic = Diagnostic::error("syntax-error", span, "a\u{1b}]0;b\u{7}");
        diagnostic = diagnostic.help("y".repeat(100_000));
        for at in 0..1000 {
            diagnostic = diagnostic.label(span, format!("label {at}"));
        }
        found.push(diagnostic);
        for format in [Format::Human, Format::Short] {
            let text = render(&sources, &found, format);
            assert!(
                !text.contains('\u{1b}') && !text.contains('\u{7}'),
                "{text}"
            );
            assert!(text.contains("988 more places"), "{text}");
            assert!(text.len() < 20_000, "{}", text.len());
        }
        let coloured = render_for(&sources, &found, Format::Human, true);
        assert!(coloured.contains("\u{1b}[1m"), "{coloured}");
        assert!(!coloured.contains("\u{1b}[2J"), "{coloured}");
    }

    #[test]
    fn a_name_with_a_line_feed_forges_no_finding() {
        let mut sources = SourceMap::new();
        let source = sources.add("a\nb:1:1: error[forged]: x.idsl", "word");
        let mut found = Diagnostics::new();
        let span = Span::new(source, 0, 1);
        let message = "cannot find `a\nc:1:1: error[forged]: y`";
        found.push(Diagnostic::error("import-not-found", span, message).label(span, "first\nhere"));
        let text = render(&sources, &found, Format::Short);
        assert_eq!(text.lines().count(), 1, "{text}");
        assert!(text.contains(r"find `a\nc:1:1"), "{text}");
        let text = render(&sources, &found, Format::Human);
        assert!(
            !text.lines().any(|line| line.starts_with("b:1:1")),
            "{text}"
        );
    }
}
