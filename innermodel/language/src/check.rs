//! Checks that need the whole document.

use crate::model::ROOT;
use rc_diagnostics::{Diagnostic, Diagnostics, Name, Span};
use std::collections::HashMap;

/// Reports ids in `allowed` that no node has. Only some of them get a suggestion, so that the time
/// stays in proportion to the file.
pub(crate) fn allowed(words: &[Name], ids: &HashMap<String, Span>, found: &mut Diagnostics) {
    const SUGGESTIONS: usize = 20;
    let unknown = words
        .iter()
        .filter(|w| w.text != ROOT && !ids.contains_key(&w.text));
    for (count, word) in unknown.enumerate() {
        let message = format!("no node has the id `{}`", word.text);
        let finding = Diagnostic::warning("unknown-id", word.span, message);
        let near = (count < SUGGESTIONS)
            .then(|| rc_diagnostics::nearest(&word.text, ids.keys().map(String::as_str)))
            .flatten();
        found.push(finding.did_you_mean(&word.text, near));
    }
}
