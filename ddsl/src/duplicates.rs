//! Reports keywords and settings that occur more than once.

use rc_diagnostics::{Diagnostic, Diagnostics, Span};
use rc_syntax::Name;
use std::collections::HashMap;

/// Reports repeated keywords.
pub(crate) fn check_unique<'a>(
    words: impl IntoIterator<Item = &'a Name>,
    what: &str,
    found: &mut Diagnostics,
) {
    let mut seen: HashMap<String, Span> = HashMap::new();
    for word in words {
        if let Some(first) = seen.insert(word.text.to_lowercase(), word.span) {
            report_duplicate(word, what, first, found);
        }
    }
}

pub(crate) fn report_duplicate(word: &Name, what: &str, first: Span, found: &mut Diagnostics) {
    let message = format!("duplicate {what} `{}`", word.text);
    let diagnostic = Diagnostic::error("repeated-clause", word.span, message);
    found.push(diagnostic.label(first, "first used here"));
}
