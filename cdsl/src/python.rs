//! The `python` clause of a component.

use crate::model::{OLDEST_PYTHON, Python};
use rc_diagnostics::{Diagnostic, Diagnostics};
use rc_syntax::Name;

/// Resolves the clause, which only components in Python have. Reports what is wrong to `found`.
pub(crate) fn python(
    word: &Name,
    version: &Name,
    venv: bool,
    language: Option<&Name>,
    found: &mut Diagnostics,
) -> Option<Python> {
    if let Some(language) = language.filter(|language| language.text != "python") {
        let message = "`python` is a clause of components with `language python;`";
        found.push(
            Diagnostic::error("python-of-another-language", word.span, message)
                .label(language.span, "the language of this component"),
        );
        return None;
    }
    let oldest = version.text.strip_prefix("3.").filter(|minor| {
        minor.len() <= 3 && minor.bytes().all(|b| b.is_ascii_digit()) && !minor.starts_with('0')
    });
    let (major, least) = OLDEST_PYTHON;
    let oldest = oldest.and_then(|minor| minor.parse().ok());
    let Some(minor) = oldest.filter(|minor| *minor >= least) else {
        let message = format!(
            "expected a version of Python from {major}.{least} on, such as `\"3.12\"`, found `{}`",
            version.text
        );
        let error = Diagnostic::error("bad-python-version", version.span, message);
        found.push(error.help("write the oldest version that the worker runs on"));
        return None;
    };
    Some(Python {
        oldest: (major, minor),
        venv,
    })
}
