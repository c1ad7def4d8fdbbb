//! A diagnostic, and the list of diagnostics of one run.

use crate::foreign::without_number;
use crate::{Fix, Span};
use std::collections::HashSet;

/// The most names that a wrong one is compared with.
const MOST_CANDIDATES: usize = 1_000;

/// How many candidates a message lists: the clauses of a component are the longest list.
const MOST_LISTED: usize = 16;

/// The severity of a diagnostic.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// The input cannot be used.
    Error,
    /// The input can be used, but is probably not what its author intended.
    Warning,
    /// Information that needs no action.
    Note,
}

impl Severity {
    /// `error`, `warning` or `note`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Error => "error",
            Self::Warning => "warning",
            Self::Note => "note",
        }
    }
}

/// A secondary location that explains a diagnostic ("declared here").
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Label {
    /// The location.
    pub span: Span,
    /// The text shown at the location.
    pub message: String,
}

/// A problem or a remark, at a location of a source text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Diagnostic {
    /// A stable identifier in kebab case: `unknown-interface`.
    pub code: &'static str,
    /// Whether the input can be used.
    pub severity: Severity,
    /// The problem: lower case, without a full stop, the user's text in backticks.
    pub message: String,
    /// The primary location.
    pub span: Span,
    /// Secondary locations.
    pub labels: Vec<Label>,
    /// How to solve the problem, in the imperative.
    pub help: Option<String>,
    /// The change of the text that solves the problem, if there is one.
    ///
    /// In a box: recursive parsers return diagnostics, and their frames have a limit.
    pub fix: Option<Box<Fix>>,
    /// Locations of secret values. Renderers replace them by asterisks.
    pub secrets: Vec<Span>,
}

impl Diagnostic {
    /// An error at `span`.
    pub fn error(code: &'static str, span: Span, message: impl Into<String>) -> Self {
        Self {
            code,
            severity: Severity::Error,
            message: without_number(&message.into()).into_owned(),
            span,
            labels: Vec::new(),
            help: None,
            fix: None,
            secrets: Vec::new(),
        }
    }

    /// A warning at `span`.
    pub fn warning(code: &'static str, span: Span, message: impl Into<String>) -> Self {
        Self {
            severity: Severity::Warning,
            ..Self::error(code, span, message)
        }
    }

    /// A note at `span`.
    pub fn note(code: &'static str, span: Span, message: impl Into<String>) -> Self {
        Self {
            severity: Severity::Note,
            ..Self::error(code, span, message)
        }
    }

    /// Adds a secondary location.
    #[must_use]
    pub fn label(mut self, span: Span, message: impl Into<String>) -> Self {
        self.labels.push(Label {
            span,
            message: message.into(),
        });
        self
    }

    /// Sets the help text.
    #[must_use]
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }

    /// Sets a certain fix: `new` instead of `old` at the location.
    #[must_use]
    pub fn fix(mut self, old: impl Into<String>, new: impl Into<String>) -> Self {
        self.fix = Some(Box::new(Fix {
            old: old.into(),
            new: new.into(),
            certain: true,
            place: None,
        }));
        self
    }

    /// Sets a suggestion: `new` instead of `old` at the location.
    #[must_use]
    pub fn likely_fix(mut self, old: impl Into<String>, new: impl Into<String>) -> Self {
        self.fix = Some(Box::new(Fix {
            old: old.into(),
            new: new.into(),
            certain: false,
            place: None,
        }));
        self
    }

    /// Sets a suggestion: the declaration `new` is added at the start of `place`.
    #[must_use]
    pub fn addition(mut self, place: Span, new: impl Into<String>) -> Self {
        self.fix = Some(Box::new(Fix {
            old: String::new(),
            new: new.into(),
            certain: false,
            place: Some(Span::new(place.source, place.start, place.start)),
        }));
        self
    }

    /// Suggests `near` instead of `name` if it is `Some`.
    #[must_use]
    pub fn did_you_mean(self, name: &str, near: Option<&str>) -> Self {
        let Some(near) = near else { return self };
        self.likely_fix(name, near)
            .help(format!("did you mean `{near}`?"))
    }

    /// Suggests the candidate nearest to `name`. If none is near, lists up to 12 candidates. Among more
    /// than 1,000 nothing is looked for: a text may have as many wrong names.
    #[must_use]
    pub fn suggest<'a>(self, name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Self {
        // One more than the limit of comparisons: no finding compares all names of a large file.
        let candidates = candidates.into_iter().take(MOST_CANDIDATES + 1);
        let candidates: Vec<&str> = candidates.collect();
        if candidates.len() > MOST_CANDIDATES {
            return self;
        }
        let near = crate::nearest(name, candidates.iter().copied());
        if near.is_some() {
            return self.did_you_mean(name, near);
        }
        if candidates.is_empty() || candidates.len() > MOST_LISTED {
            return self;
        }
        let list: Vec<String> = candidates.iter().map(|c| format!("`{c}`")).collect();
        self.help(match list.as_slice() {
            [only] => format!("expected {only}"),
            _ => format!("expected one of {}", list.join(", ")),
        })
    }
}

/// The diagnostics of one run, without duplicates.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Diagnostics {
    all: Vec<Diagnostic>,
    /// Keys of `all`. A set keeps `push` linear in a file full of mistakes.
    seen: HashSet<(&'static str, Span, String)>,
}

impl Diagnostics {
    /// An empty list.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a diagnostic unless the list contains an equal one. Two components that import one
    /// broken file report it once.
    pub fn push(&mut self, diagnostic: Diagnostic) {
        let key = (diagnostic.code, diagnostic.span, diagnostic.message.clone());
        if self.seen.insert(key) {
            self.all.push(diagnostic);
        }
    }

    /// Adds each of `others` as [`push`](Self::push) does.
    pub fn extend(&mut self, others: impl IntoIterator<Item = Diagnostic>) {
        others.into_iter().for_each(|d| self.push(d));
    }

    /// Marks `secrets` as secret in all diagnostics added so far.
    pub fn redact(&mut self, secrets: &[Span]) {
        for diagnostic in &mut self.all {
            diagnostic.secrets.extend_from_slice(secrets);
        }
    }

    /// Whether the list contains an error.
    pub fn has_errors(&self) -> bool {
        self.all.iter().any(|d| d.severity == Severity::Error)
    }

    /// Whether the list is empty.
    pub fn is_empty(&self) -> bool {
        self.all.is_empty()
    }

    /// All diagnostics, ordered by location.
    pub fn sorted(&self) -> Vec<&Diagnostic> {
        let mut all: Vec<&Diagnostic> = self.all.iter().collect();
        all.sort_by_key(|d| (d.span, d.severity));
        all
    }

    /// All diagnostics, in the order in which they were added.
    pub fn iter(&self) -> impl Iterator<Item = &Diagnostic> {
        self.all.iter()
    }
}

impl IntoIterator for Diagnostics {
    type Item = Diagnostic;
    type IntoIter = std::vec::IntoIter<Diagnostic>;

    fn into_iter(self) -> Self::IntoIter {
        self.all.into_iter()
    }
}
