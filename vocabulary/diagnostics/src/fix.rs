//! Fixes: changes of a text that solve a problem.

use crate::{Diagnostics, SourceId, SourceMap, Span};

/// The longest text that is fixed, in bytes.
const LONGEST: usize = 4096;

/// The solution of the problem of a diagnostic: a replacement in its location, or elsewhere.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fix {
    /// The text that is replaced, which occurs once in the location of the diagnostic. Empty for an
    /// insertion.
    pub old: String,
    /// The replacement.
    pub new: String,
    /// Whether only this can have been meant. A near name is a suggestion.
    pub certain: bool,
    /// Where the replacement is, if it is not in the location of the diagnostic. An addition there may
    /// have quotes and ends of lines: it is a whole declaration, and no part of it comes from another
    /// program.
    pub place: Option<Span>,
}

impl Fix {
    /// The edit of the diagnostic at `span`. `None` if the text there does not hold [`Fix::old`]
    /// exactly once, as a whole word, or if the new text needs quotes of its own.
    pub fn edit(&self, sources: &SourceMap, span: Span) -> Option<Edit> {
        let span = self.place.unwrap_or(span);
        let text = sources.text(span.source).get(span.start..span.end)?;
        // Searching or printing a word in many long texts would take too long.
        if text.len() > LONGEST || self.new.len() > LONGEST {
            return None;
        }
        let plain = |c: char| !c.is_control() && !matches!(c, '"' | '\\' | '`');
        let quotes = self.new == "\"" && self.certain;
        let adds = self.place.is_some() && self.old.is_empty();
        if !quotes && !adds && !self.new.chars().all(plain) {
            return None;
        }
        let mut places = text.match_indices(&self.old).map(|(at, _)| at);
        let mut places = places.by_ref().filter(|at| self.is_whole(text, *at));
        let start = span.start + places.next()?;
        // An empty text is found after each character.
        let only = self.old.is_empty() || places.next().is_none();
        only.then(|| Edit {
            span: Span::new(span.source, start, start + self.old.len()),
            text: self.new.clone(),
        })
    }

    /// Whether no letter before or after continues the word at `at`.
    fn is_whole(&self, text: &str, at: usize) -> bool {
        let is_word = |c: char| c.is_alphanumeric() || c == '_';
        let (before, behind) = (&text[..at], &text[at + self.old.len()..]);
        let begins = self.old.starts_with(is_word) && before.ends_with(is_word);
        let ends = self.old.ends_with(is_word) && behind.starts_with(is_word);
        !begins && !ends
    }
}

/// A replacement of a part of a text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Edit {
    /// The text that is replaced. Empty for an insertion.
    pub span: Span,
    /// The replacement.
    pub text: String,
}

/// The edits of all diagnostics about one text, in its order; with `likely`, also suggestions.
///
/// Of overlapping edits, the first counts: the other one may be right only without it.
pub fn edits(
    sources: &SourceMap,
    found: &Diagnostics,
    source: SourceId,
    likely: bool,
) -> Vec<Edit> {
    let mut edits: Vec<Edit> = found
        .iter()
        .filter_map(|diagnostic| {
            let fix = diagnostic.fix.as_ref()?;
            let place = fix.place.unwrap_or(diagnostic.span);
            let wanted = place.source == source && (likely || fix.certain);
            wanted.then(|| fix.edit(sources, diagnostic.span))?
        })
        .collect();
    edits.sort_by_key(|edit| edit.span);
    let mut end = None;
    edits.retain(|edit| {
        let free = end.is_none_or(|end| edit.span.start >= end);
        let repeated = end == Some(edit.span.start) && edit.span.end == edit.span.start;
        let kept = free && !repeated;
        if kept {
            end = Some(edit.span.end);
        }
        kept
    });
    edits
}

/// A text with `edits`, which are in its order and do not overlap.
pub fn edited(text: &str, edits: &[Edit]) -> String {
    let mut out = String::with_capacity(text.len());
    let mut at = 0;
    for edit in edits {
        out.push_str(text.get(at..edit.span.start).unwrap_or_default());
        out.push_str(&edit.text);
        at = edit.span.end;
    }
    out.push_str(text.get(at..).unwrap_or_default());
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Diagnostic;

    /// The text after the fixes of findings at ranges of bytes.
    fn fixed(text: &str, finds: &[(usize, usize, &str, &str, bool)], likely: bool) -> String {
        let mut sources = SourceMap::new();
        let source = sources.add("a.idsl", text);
        let mut found = Diagnostics::new();
        for (start, end, old, new, certain) in finds {
            let span = Span::new(source, *start, *end);
            let mut one = Diagnostic::error("syntax-error", span, format!("{start} {old} {new}"));
            one.fix = Some(Box::new(Fix {
                old: (*old).to_owned(),
                new: (*new).to_owned(),
                certain: *certain,
                place: None,
            }));
            found.push(one);
        }
        edited(text, &edits(&sources, &found, source, likely))
    }

    #[test]
    fn certain_fixes_and_suggestions_are_told_apart() {
        let finds = [(6, 6, "", ";", true), (0, 3, "abc", "abd", false)];
        assert_eq!(fixed("abc xy", &finds, false), "abc xy;");
        assert_eq!(fixed("abc xy", &finds, true), "abd xy;");
    }

    #[test]
    fn only_a_whole_word_that_stands_there_once_is_replaced() {
        for (text, expected) in [
            ("\"Lasr\"", "\"Laser\""),
            ("a.Lasr", "a.Laser"),
            ("Lasr Lasr", "Lasr Lasr"),
            ("Lasrs", "Lasrs"),
            ("xLasr Lasr", "xLasr Laser"),
            ("none", "none"),
        ] {
            let find = [(0, text.len(), "Lasr", "Laser", false)];
            assert_eq!(fixed(text, &find, true), expected);
        }
    }

    #[test]
    fn of_overlapping_edits_the_first_counts() {
        let finds = [(0, 3, "abc", "x", true), (1, 2, "b", "y", true)];
        assert_eq!(fixed("abc", &finds, false), "x");
        let finds = [(3, 3, "", ";", true), (3, 3, "", ";;", true)];
        assert_eq!(fixed("abc", &finds, false), "abc;");
    }

    #[test]
    fn a_text_that_needs_escapes_is_not_written() {
        for new in ["a\"b", "a\nb", "a\\b"] {
            assert_eq!(fixed("abc", &[(0, 3, "abc", new, false)], true), "abc");
        }
        assert_eq!(fixed("“", &[(0, 3, "“", "\"", true)], false), "\"");
        // Elsewhere, too, only an addition may have quotes.
        let mut sources = SourceMap::new();
        let source = sources.add("a.idsl", "abc");
        let mut fix = Fix {
            old: "abc".to_owned(),
            new: "a\"b".to_owned(),
            certain: false,
            place: Some(Span::new(source, 0, 3)),
        };
        assert_eq!(fix.edit(&sources, Span::new(source, 0, 0)), None);
        fix.old.clear();
        assert!(fix.edit(&sources, Span::new(source, 0, 0)).is_some());
    }
}
